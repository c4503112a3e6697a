// Greys in closed form; planted motions are inverted by fixed points.
#include "tests/support/limb.h"

#include <algorithm>
#include <cmath>
#include <random>

#include "pipeline/artifacts/held.h"

namespace kvx::testing_support::limb {

Grid LimbGrid(const Eigen::Vector3i& size) {
  Grid grid;
  grid.size = size;
  grid.spacing_mm = Eigen::Vector3d::Constant(kSpacing);
  return grid;
}

double FromAxis(const Eigen::Vector3d& x) { return std::hypot(x.x() - kCentre.x(), x.y() - kCentre.y()); }
bool InBody(const Eigen::Vector3d& x) { return (x - kCentre).norm() < kBodyRadius; }
bool InBone(const Eigen::Vector3d& x) { return InBody(x) && FromAxis(x) < kBoneRadius; }

namespace {

double Intensity(const Eigen::Vector3d& x) {
  const double edge = 1 / (1 + std::exp(((x - kCentre).norm() - kBodyRadius) / 0.6));
  const double lumps = std::sin(0.55 * x.x() + 0.2 * x.y()) * std::cos(0.5 * x.y() - 0.15 * x.z()) +
                       std::sin(0.6 * x.z() + 0.25 * x.x());
  const double bone = 1 / (1 + std::exp((FromAxis(x) - kBoneRadius) / 0.6));
  return edge * ((1 - bone) * (100 + 25 * lumps) + bone * (170 + 8 * std::sin(0.8 * x.z())));
}

// The inverse of x + u(x) by fixed point: u is small and smooth enough for it.
Eigen::Vector3d Inverse(const Motion& u, const Eigen::Vector3d& y) {
  Eigen::Vector3d x = y;
  for (int n = 0; n < 30; ++n) x = y - u(x);
  return x;
}

Eigen::Vector3d BumpBesideTheRod(const Eigen::Vector3d& x, double width_mm) {
  const double squared_mm = (x - kCentre - Eigen::Vector3d(15, 0, 0)).squaredNorm();
  return std::exp(-squared_mm / (2 * width_mm * width_mm)) * Eigen::Vector3d(1.2, 2.6, -1.6);
}

}  // namespace

Scan Render(const Grid& grid, const Motion& template_from_scan, unsigned seed, double gain, double bias,
            double noise_sigma) {
  Scan scan;
  scan.volume = Volume(grid);
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, noise_sigma);
  for (size_t v = 0; v < scan.volume.values.size(); ++v) {
    const Eigen::Vector3d x = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps;
    scan.volume.values[v] = float(gain * Intensity(template_from_scan(x)) + bias + noise(random));
  }
  return scan;
}

RegisteredScan Register(const Scan& template_scan, const Scan& scan, const RegisterScan::Options& options) {
  const Grid& grid = template_scan.volume.grid;
  Mask body(grid);
  BoneSet bones;
  bones.bones.push_back({.label = 1, .name = "rod"});
  bones.labels = LabelMap(grid);
  for (size_t v = 0; v < body.values.size(); ++v) {
    const Eigen::Vector3d x = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps;
    body.values[v] = InBody(x);
    bones.labels.values[v] = InBone(x);
  }
  VoxelWeights rigid;
  rigid.weights[0] = 1;
  const auto t = Held(template_scan), s = Held(scan);
  const auto b = Held(body);
  const auto set = Held(bones);
  const auto weights = Held(WeightMap(grid, rigid));
  const auto fits = Held(BoneFits(1));
  StageContext context{SharedBackend(), {}};
  return RegisterScan::Run({t, b, set, weights, fits, s}, options, context);
}

Eigen::Vector3d Identity(const Eigen::Vector3d& x) { return x; }
Eigen::Vector3d Bump(const Eigen::Vector3d& x) { return BumpBesideTheRod(x, 7.5); }
Eigen::Vector3d TemplateFromBumped(const Eigen::Vector3d& y) { return Inverse(Bump, y); }

Eigen::Vector3d WideBump(const Eigen::Vector3d& x) {
  const double away = std::clamp((FromAxis(x) - kBoneRadius) / 6, 0.0, 1.0);
  return away * away * (3 - 2 * away) * BumpBesideTheRod(x, 12);
}
Eigen::Vector3d TemplateFromWideBump(const Eigen::Vector3d& y) { return Inverse(WideBump, y); }

Errors Compare(const RegisteredScan& result, const Motion& truth, double least_mm) {
  Errors out;
  int n = 0;
  const Grid& grid = result.scan_from_template.grid;
  for (size_t v = 0; v < result.scan_from_template.values.size(); ++v) {
    const Eigen::Vector3d x = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps;
    const Eigen::Vector3d u = result.scan_from_template.values[v].cast<double>();
    if (InBone(x)) out.bone_mm = std::max(out.bone_mm, u.norm());
    if (!InBody(x) || InBone(x) || truth(x).norm() < least_mm) continue;
    out.mean_mm += (u - truth(x)).norm();
    out.before_mm += truth(x).norm();
    ++n;
  }
  out.mean_mm /= n;
  out.before_mm /= n;
  return out;
}

}  // namespace kvx::testing_support::limb
