// Lattices of poses. Steps follow from the bone: refinement finds its way over about 0.4 of the bone's
// thickness.
#include "pipeline/bones/search/candidate_poses.h"

#include <algorithm>
#include <cmath>

namespace kvx {
namespace {

constexpr double kCapture = 0.4;             // of the thickness
constexpr double kMostCandidates = 1 << 24;  // a bone of a voxel would have hundreds of times as many

RigidTransform Shift(const Eigen::Vector3d& by_mm) { return {Eigen::Quaterniond::Identity(), by_mm}; }

RigidTransform TurnAbout(const Eigen::Vector3d& centre_mm, const Eigen::Quaterniond& rotation) {
  return {rotation, centre_mm - rotation * centre_mm};
}

Eigen::Quaterniond FromRotationVector(const Eigen::Vector3d& v) {
  const double angle = v.norm();
  return angle < 1e-12 ? Eigen::Quaterniond::Identity()
                       : Eigen::Quaterniond(Eigen::AngleAxisd(angle, v / angle));
}

// Directions at `step` within `limit` of the pole, as rotations that bring the pole there without twist.
std::vector<Eigen::Quaterniond> Swings(const Eigen::Vector3d& pole, double step_rad, double limit_rad) {
  const Eigen::Vector3d u = pole.unitOrthogonal(), v = pole.cross(u);
  std::vector<Eigen::Quaterniond> swings{Eigen::Quaterniond::Identity()};
  for (double theta = step_rad; theta <= limit_rad + 1e-9; theta += step_rad) {
    const int around = std::max(4, int(std::ceil(2 * kPi * std::sin(theta) / step_rad)));
    for (int n = 0; n < around; ++n) {
      const double phi = 2 * kPi * n / around;
      swings.emplace_back(Eigen::AngleAxisd(theta, std::cos(phi) * u + std::sin(phi) * v));
    }
  }
  return swings;
}

std::vector<Eigen::Vector3d> AxisShifts(double step_mm) {
  std::vector<Eigen::Vector3d> shifts{Eigen::Vector3d::Zero()};
  for (int a = 0; a < 3; ++a) {
    for (const double side : {-1.0, 1.0}) shifts.push_back(side * step_mm * Eigen::Vector3d::Unit(a));
  }
  return shifts;
}

}  // namespace

double StepMm(const BoneShape& bone) { return kCapture * bone.thickness_mm; }

std::vector<Eigen::Vector3d> RotationLattice(double step_rad, double limit_rad) {
  const int n = int(limit_rad / step_rad);
  std::vector<Eigen::Vector3d> rotations;
  for (int k = -n; k <= n; ++k) {
    for (int j = -n; j <= n; ++j) {
      for (int i = -n; i <= n; ++i) {
        const Eigen::Vector3d v = step_rad * Eigen::Vector3d(i, j, k);
        if (v.norm() <= limit_rad) rotations.push_back(v);
      }
    }
  }
  return rotations;
}

RootCandidates::RootCandidates(const BoneShape& root, const Grid& scan)
    : centroid_mm_(root.centroid_mm), scan_(scan) {
  const double step_rad =
      std::clamp(2 * StepMm(root) / (0.5 * root.length_mm), RadFromDeg(15), RadFromDeg(25));
  for (const Eigen::Vector3d& turn : RotationLattice(step_rad, RadFromDeg(75)))
    turns_.push_back(FromRotationVector(turn));
  const Eigen::Vector3d size_mm = scan.spacing_mm.cwiseProduct(scan.size.cast<double>());
  const double least_mm = std::cbrt(size_mm.prod() * double(turns_.size()) / kMostCandidates);
  const double step_mm = std::max(StepMm(root), least_mm);
  steps_ = (size_mm.array() / step_mm).ceil().cast<int>().max(1).matrix();
}

// Places along x first, turns last.
RigidTransform RootCandidates::operator[](size_t n) const {
  const size_t places = size_t(steps_.prod()), place = n % places;
  const size_t of_row = size_t(steps_.x()), of_slice = of_row * size_t(steps_.y());
  const Eigen::Vector3d at(double(place % of_row), double(place % of_slice / of_row),
                           double(place / of_slice));
  const Eigen::Vector3d part = (at.array() + 0.5) / steps_.cast<double>().array();
  const Eigen::Vector3d vox = part.cwiseProduct((scan_.size.array() - 1).cast<double>().matrix());
  const Eigen::Quaterniond& rotation = turns_[n / places];
  return {rotation, scan_.ToMm(PointVox{vox}).lps - rotation * centroid_mm_};
}

std::vector<RigidTransform> JointCandidates(const BoneShape& child, const JointShape& joint,
                                            const RigidTransform& parent) {
  const Eigen::Vector3d contact = joint.pivots_mm.front();
  const Eigen::Vector3d outwards = child.centroid_mm - contact;
  const Eigen::Vector3d pole =
      outwards.norm() > 1e-6 ? outwards.normalized() : Eigen::Vector3d(child.axes.col(0));
  const double step_mm = StepMm(child);
  const double lever_mm = outwards.norm() + 0.5 * child.length_mm;
  const double step_rad = std::clamp(2 * step_mm / lever_mm, RadFromDeg(8), RadFromDeg(18));
  const auto swings = Swings(pole, step_rad, RadFromDeg(120));
  const auto shifts = AxisShifts(step_mm);
  std::vector<RigidTransform> out;
  for (const Eigen::Vector3d& pivot : joint.pivots_mm) {
    for (const Eigen::Quaterniond& swing : swings) {
      for (const double twist_deg : {-50.0, -25.0, 0.0, 25.0, 50.0}) {
        const Eigen::Quaterniond rotation =
            swing * Eigen::Quaterniond(Eigen::AngleAxisd(RadFromDeg(twist_deg), pole));
        const RigidTransform turned = TurnAbout(pivot, rotation);
        for (const Eigen::Vector3d& shift : shifts) out.push_back(parent * Shift(shift) * turned);
      }
    }
  }
  return out;
}

std::vector<RigidTransform> SuggestedMotions(const std::optional<RigidTransform>& parent,
                                             const std::vector<int>& neighbours, const PartialPose& placed) {
  std::vector<RigidTransform> out;
  if (parent) out.push_back(*parent);
  int used = 0;
  for (const int n : neighbours) {
    if (!placed[n] || used == 4) continue;
    ++used;
    out.push_back(*placed[n]);
    if (!parent) continue;
    const Twist between = Log(parent->Inverse() * *placed[n]);
    for (const double part : {1.0 / 3, 2.0 / 3}) out.push_back(*parent * Exp(part * between));
  }
  return out;
}

std::vector<RigidTransform> LocalCandidates(const BoneShape& bone, const RigidTransform& pose) {
  const double step_mm = StepMm(bone);
  const double step_rad = std::clamp(2 * step_mm / bone.length_mm, RadFromDeg(10), RadFromDeg(20));
  std::vector<RigidTransform> out;
  for (const Eigen::Vector3d& turn : RotationLattice(step_rad, 1.8 * step_rad)) {
    const RigidTransform turned = pose * TurnAbout(bone.centroid_mm, FromRotationVector(turn));
    for (int k = -1; k <= 1; ++k) {
      for (int j = -1; j <= 1; ++j) {
        for (int i = -1; i <= 1; ++i) out.push_back(Shift(step_mm * Eigen::Vector3d(i, j, k)) * turned);
      }
    }
  }
  return out;
}

std::vector<RigidTransform> PosesBeside(const BoneShape& bone, const RigidTransform& pose, double step_mm) {
  const double step_rad = std::min(2 * step_mm / bone.length_mm, RadFromDeg(25));
  std::vector<RigidTransform> out;
  for (int a = 0; a < 3; ++a) {
    for (const double side : {-1.0, 1.0}) {
      out.push_back(Shift(side * step_mm * Eigen::Vector3d::Unit(a)) * pose);
      const Eigen::AngleAxisd turn(side * step_rad, bone.axes.col(a));
      out.push_back(pose * TurnAbout(bone.centroid_mm, Eigen::Quaterniond(turn)));
    }
  }
  return out;
}

}  // namespace kvx
