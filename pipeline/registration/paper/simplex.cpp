// NLopt's LN_NELDERMEAD.
#include "pipeline/registration/paper/simplex.h"

#include <nlopt.h>

#include <algorithm>
#include <memory>

namespace kvx {
namespace {

struct Watched {
  const std::function<double(std::span<const double>)>& cost;
  SimplexResult best;
};

double Evaluate(unsigned count, const double* x, double*, void* data) {
  Watched& watched = *static_cast<Watched*>(data);
  const double value = watched.cost({x, count});
  if (watched.best.evaluations++ == 0 || value < watched.best.value) {
    watched.best.at.assign(x, x + count);
    watched.best.value = value;
  }
  return value;
}

}  // namespace

SimplexResult MinimiseBySimplex(const std::function<double(std::span<const double>)>& cost,
                                std::vector<double> start, const SimplexOptions& options) {
  const std::unique_ptr<nlopt_opt_s, void (*)(nlopt_opt)> optimiser(
      nlopt_create(NLOPT_LN_NELDERMEAD, unsigned(start.size())), nlopt_destroy);
  Watched watched{cost, {}};
  nlopt_set_min_objective(optimiser.get(), Evaluate, &watched);
  nlopt_set_lower_bounds1(optimiser.get(), -options.bound);
  nlopt_set_upper_bounds1(optimiser.get(), options.bound);
  nlopt_set_initial_step1(optimiser.get(), options.first_step);
  nlopt_set_xtol_abs1(optimiser.get(), options.least_step);
  nlopt_set_ftol_rel(optimiser.get(), options.least_gain);
  nlopt_set_maxeval(optimiser.get(), options.most_evaluations);
  for (double& x : start) x = std::clamp(x, -options.bound, options.bound);
  double value = 0;
  // However it ends (converged, budget spent, lost to rounding), the best point seen is what counts.
  nlopt_optimize(optimiser.get(), start.data(), &value);
  return std::move(watched.best);
}

}  // namespace kvx
