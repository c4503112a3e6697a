// The hinge's geometry, texture and files.
#include "tests/support/hinge_study.h"

#include <algorithm>
#include <cmath>
#include <fstream>

#include "core/numbers/smooth_step.h"
#include "pipeline/io/volume_file.h"

namespace kvx::testing_support {
namespace {

constexpr double kLimbRadiusMm = 17, kLimbHalfLengthMm = 31, kBlendMm = 6;
constexpr double kBoneRadiusMm = 6, kBoneNearMm = 12,
                 kBoneFarMm = 23;  // capsule axis, distance from the hinge plane

double DistanceToBone(const Eigen::Vector3d& x, double side) {
  const double along = std::clamp(side * x.z(), kBoneNearMm, kBoneFarMm);
  const Eigen::Vector3d nearest(side * 2.0, 1.0, side * along);
  return (x - nearest).norm() -
         kBoneRadiusMm * (1 + 0.12 * std::sin(0.5 * x.z() + 2 * std::atan2(x.y(), x.x())));
}

double LowerWeight(double z) { return SmoothStep(-kBlendMm, kBlendMm, -z); }

// Waves in several directions: every place looks different.
double Texture(const Eigen::Vector3d& x) {
  const Eigen::Vector3d waves[] = {
      {0.55, 0.2, 0.1}, {-0.15, 0.6, 0.25}, {0.2, -0.3, 0.5}, {0.3, 0.35, -0.4}, {-0.05, 0.1, 0.9}};
  double sum = 0;
  for (int i = 0; i < 5; ++i) sum += std::sin(waves[i].dot(x) + 1.3 * i);
  return sum;
}

double IntensityAt(const Eigen::Vector3d& x) {
  const double limb = std::max(std::hypot(x.x(), x.y()) - kLimbRadiusMm, std::abs(x.z()) - kLimbHalfLengthMm);
  const double inside = std::clamp(0.5 - limb, 0.0, 1.0);
  double tissue = 110 + 14 * Texture(x);
  for (const double side : {1.0, -1.0}) {
    const double d = DistanceToBone(x, side);
    const double shell = std::clamp(0.5 - d, 0.0, 1.0), marrow = std::clamp(-1.5 - d, 0.0, 1.0);
    tissue += shell * (30 - tissue) + marrow * (190 + 10 * Texture(1.5 * x) - 30);
  }
  return inside * tissue;
}

// A repeatable pseudo-random value in [-1, 1] per voxel.
double Noise(size_t voxel, size_t scan) {
  uint64_t h = (voxel + 1) * 0x9E3779B97F4A7C15ull + scan * 0xD1B54A32D192ED03ull;
  h = (h ^ (h >> 29)) * 0xBF58476D1CE4E5B9ull;
  return double((h >> 33) & 0xFFFF) / 32767.5 - 1;
}

}  // namespace

PointMm Hinge::Centre() { return {Eigen::Vector3d(0.5, -1, 0)}; }
Eigen::Vector3d Hinge::Axis() { return Eigen::Vector3d::UnitX(); }

Grid Hinge::ScanGrid() {
  Grid grid;
  grid.size = {40, 42, 60};
  grid.spacing_mm = {1.25, 1.2, 1.3};
  grid.origin.lps = {-24.4, -24.6, -38.4};
  return grid;
}

RigidTransform Hinge::ScanFromLower(const HingePose& pose) {
  return pose.scan_from_upper * RotationAbout(Centre(), Axis(), pose.flexion_rad);
}

PointMm Hinge::Moved(const PointMm& x, const HingePose& pose) {
  const double share = LowerWeight(x.lps.z());
  return pose.scan_from_upper * (RotationAbout(Centre(), Axis(), share * pose.flexion_rad) * x);
}

Volume Hinge::ScanOf(const HingePose& pose) {
  Volume scan(ScanGrid());
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const PointMm y = scan.grid.ToMm(PointVox{scan.grid.Ijk(v).cast<double>()});
    PointMm x = pose.scan_from_upper.Inverse() * y;  // fixed point of x = x + (y - Moved(x)) pulled back
    for (int i = 0; i < 25; ++i)
      x.lps += pose.scan_from_upper.rotation.conjugate() * (y.lps - Moved(x, pose).lps);
    scan.values[v] = float(std::max(0.0, IntensityAt(x.lps) + 3 * Noise(v, size_t(1e6 * pose.flexion_rad))));
  }
  return scan;
}

LabelMap Hinge::Labels() {
  LabelMap labels(ScanGrid());
  for (size_t v = 0; v < labels.values.size(); ++v) {
    const Eigen::Vector3d x = labels.grid.ToMm(PointVox{labels.grid.Ijk(v).cast<double>()}).lps;
    if (DistanceToBone(x, 1) < 0) labels.values[v] = 1;
    if (DistanceToBone(x, -1) < 0) labels.values[v] = 2;
  }
  return labels;
}

std::vector<HingePose> HingePoses() {
  const RigidTransform turned = RotationAbout({Eigen::Vector3d(3, 2, 8)}, {1, 2, 3}, RadFromDeg(4));
  const RigidTransform moved{Eigen::Quaterniond::Identity(), {1.5, -1, 2}};
  return {{0, {}}, {RadFromDeg(9), moved}, {RadFromDeg(18), moved * turned}};
}

std::filesystem::path WriteHingeStudy(const std::filesystem::path& folder) {
  const std::vector<HingePose> poses = HingePoses();
  for (size_t k = 0; k < poses.size(); ++k) {
    WriteVolume(folder / ("pose0" + std::to_string(k) + ".nii.gz"), Hinge::ScanOf(poses[k]),
                ScalarType::kUint8);
  }
  WriteLabels(folder / "bones.nii.gz", Hinge::Labels());
  const std::filesystem::path study = folder / "study.json";
  std::ofstream(study) << R"({"name": "hinge", "region": "custom", "template": "pose00",
    "scans": [{"name": "pose00", "volume": "pose00.nii.gz"}, {"name": "pose01", "volume": "pose01.nii.gz"},
              {"name": "pose02", "volume": "pose02.nii.gz"}],
    "bones": {"labels": "bones.nii.gz", "list": [{"label": 1, "name": "upper", "parent": null},
                                                  {"label": 2, "name": "lower", "parent": "upper"}]},
    "joints": [{"child": "lower", "dofs": ["flexion"]}]})";
  return study;
}

}  // namespace kvx::testing_support
