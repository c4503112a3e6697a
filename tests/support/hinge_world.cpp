// Everything follows from the distance along the bar.
#include "tests/support/hinge_world.h"

#include <algorithm>
#include <cmath>

#include "core/numbers/smooth_step.h"
#include "tests/support/fixtures.h"

namespace kvx::testing_support {

HingeWorld::HingeWorld(const Eigen::Vector3i& size) {
  const Grid grid = ObliqueGrid(size);
  hinge = grid.ToMm(PointVox{0.5 * (size.array() - 1).cast<double>().matrix()});
  along = grid.direction.col(2);
  across = grid.direction.col(0);
  scan.volume = Volume(grid, kAir);
  body = Mask(grid);
  weights = WeightMap(grid);
  bones.labels = LabelMap(grid);
  bones.bones = {{.label = 1, .name = "inner", .parent = kNoParent},
                 {.label = 2, .name = "outer", .parent = 0}};
  for (size_t v = 0; v < body.values.size(); ++v) {
    const PointMm x = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()});
    const double s = along.dot(x.lps - hinge.lps), outer = SmoothStep(-blend_mm, blend_mm, s);
    const bool outer_first = outer > 0.5;
    weights.values[v].bones = {uint8_t(outer_first), uint8_t(!outer_first), 0, 0};
    weights.values[v].weights = {float(std::max(outer, 1 - outer)), float(std::min(outer, 1 - outer)), 0, 0};
    if (!DeepInside(x, 0)) continue;
    body.values[v] = 1;
    scan.volume.values[v] = float(TextureAt(x));
    if (DeepInside(x, 4) && std::abs(s) > blend_mm) bones.labels.values[v] = s < 0 ? 1 : 2;
  }
}

bool HingeWorld::DeepInside(const PointMm& x, double inset_mm) const {
  const Eigen::Vector3d r = x.lps - hinge.lps;
  const double s = along.dot(r);
  return std::abs(s) < half_length_mm - inset_mm && (r - s * along).norm() < half_width_mm - inset_mm;
}

double HingeWorld::TextureAt(const PointMm& x) const {
  const Eigen::Vector3d r = x.lps - hinge.lps;
  return 100 + 20 * std::sin(0.5 * r.x()) + 15 * std::cos(0.4 * r.y() + 0.7) +
         10 * std::sin(0.45 * r.z() + 0.2 * r.x());
}

PoseVector HingeWorld::Bent(double angle_rad) const {
  return {RigidTransform{}, RotationAbout(hinge, across, angle_rad)};
}

DisplacementField HingeWorld::Bulge(double amplitude_mm) const {
  DisplacementField d(body.grid, Eigen::Vector3f::Zero());
  for (size_t v = 0; v < d.values.size(); ++v) {
    const Eigen::Vector3d r = body.grid.ToMm(PointVox{body.grid.Ijk(v).cast<double>()}).lps - hinge.lps;
    const double s = along.dot(r), radius = (r - s * along).norm();
    const double size = amplitude_mm * std::exp(-s * s / 50) * radius * radius / (radius * radius + 16);
    if (radius > 0) d.values[v] = (size * (r - s * along) / radius).cast<float>();
  }
  return d;
}

ResolvedPose HingeWorld::Posed(const PoseVector& pose) const {
  return {pose, Eigen::MatrixXf::Zero(bones.size(), 0), Eigen::VectorXd::Zero(bones.size())};
}

PosingInputs HingeWorld::Inputs(std::vector<const DisplacementField*> examples) const {
  return {scan, body, bones, weights, std::move(examples)};
}

}  // namespace kvx::testing_support
