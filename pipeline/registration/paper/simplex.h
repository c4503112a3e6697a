// Nelder and Mead's simplex inside a box; the only file pair that knows the optimisation library.
#pragma once
#include <functional>
#include <span>
#include <vector>

namespace kvx {

struct SimplexOptions {
  double bound = 1;          // every coordinate stays within -bound .. bound
  double first_step = 0.1;   // size of the first simplex
  double least_step = 1e-3;  // ends when the simplex is smaller along every axis
  double least_gain = 1e-4;  // ... or its values agree to this share
  int most_evaluations = 1000;
};

struct SimplexResult {
  std::vector<double> at;
  double value = 0;
  int evaluations = 0;
};

// Deterministic. `cost` must not throw. The result is never worse than `start`.
SimplexResult MinimiseBySimplex(const std::function<double(std::span<const double>)>& cost,
                                std::vector<double> start, const SimplexOptions& options);

}  // namespace kvx
