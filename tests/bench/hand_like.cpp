// The hand-like body, voxel by voxel.
#include "tests/bench/hand_like.h"

namespace kvx {

HandLike::HandLike(const HandShape& shape) {
  const Eigen::Vector3d full(256, 256, 100), spacing_mm(0.8, 0.8, 0.9);
  grid.size = (shape.scale * full).array().round().cast<int>();
  grid.spacing_mm = spacing_mm / shape.scale;
  grid.origin.lps = {-102, -20, -45};
  scan.volume = Volume(grid, 3.0f);
  body = Mask(grid);
  weights = WeightMap(grid);
  bones.labels = LabelMap(grid);
  for (int k = 0; k < shape.examples; ++k) examples.emplace_back(grid, Eigen::Vector3f::Zero());
  for (size_t v = 0; v < body.values.size(); ++v)
    Voxel(v, grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps, shape.fingers);
  bones.bones.resize(kFingers * kBonesPerFinger);
}

void HandLike::Voxel(size_t v, const Eigen::Vector3d& x, int fingers) {
  const int finger = std::clamp(int(std::floor((x.x() + 50) / 20)), 0, kFingers - 1);
  const double joint = std::clamp(x.y() / 35, 0.0, kBonesPerFinger - 0.501) - 0.5;
  const int first = std::clamp(int(std::floor(joint)), 0, kBonesPerFinger - 2);
  const double t = std::clamp((joint - first - 0.5) * 35 / 5 + 0.5, 0.0, 1.0);
  const int a = finger * kBonesPerFinger + first;
  weights.values[v].bones = {uint8_t(t > 0.5 ? a + 1 : a), uint8_t(t > 0.5 ? a : a + 1), 0, 0};
  weights.values[v].weights = {float(std::max(t, 1 - t)), float(std::min(t, 1 - t)), 0, 0};
  const double across = x.x() + 50 - 20 * finger - 10;
  const bool palm = x.y() > -15 && x.y() < 75 && std::abs(x.x()) < 50 && std::abs(x.z()) < 16;
  const bool digit = x.y() >= 75 && x.y() < 150 && std::hypot(across, x.z()) < 8.8;
  if ((!palm && !digit) || finger >= fingers) return;
  body.values[v] = 1;
  if (std::hypot(across, x.z()) < 5) bones.labels.values[v] = uint16_t(1 + weights.values[v].bones[0]);
  scan.volume.values[v] =
      float(120 + 40 * std::sin(0.6 * x.x()) * std::cos(0.5 * x.y()) + 20 * std::sin(0.7 * x.z()));
  for (size_t k = 0; k < examples.size(); ++k) {
    examples[k].values[v] =
        Eigen::Vector3f(std::sin(0.05f * float(x.x()) + float(k)), std::cos(0.04f * float(x.y()) - float(k)),
                        std::sin(0.06f * float(x.z()) + 2 * float(k)));
  }
}

ResolvedPose HandLike::Pose(double bend_rad) const {
  ResolvedPose pose{
      {}, Eigen::MatrixXf::Constant(kFingers * kBonesPerFinger, Eigen::Index(examples.size()), 0.1f), {}};
  for (int finger = 0; finger < kFingers; ++finger) {
    RigidTransform bone;
    for (int b = 0; b < kBonesPerFinger; ++b) {
      if (b >= 2)
        bone = bone *
               RotationAbout({{0, 35.0 * b, 0}}, Eigen::Vector3d::UnitX(), bend_rad * (0.6 + 0.1 * finger));
      pose.scan_from_template.push_back(bone);
    }
  }
  return pose;
}

PosingInputs HandLike::Inputs() const {
  PosingInputs in{scan, body, bones, weights, {}};
  for (const DisplacementField& d : examples) in.examples.push_back(&d);
  return in;
}

}  // namespace kvx
