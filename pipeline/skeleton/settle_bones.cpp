// Settles all scans, then names what remains doubtful.
#include "pipeline/skeleton/settle_bones.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "pipeline/skeleton/joint_model.h"

namespace kvx {
namespace {

constexpr double kOdd = 5.0;                     // standard deviations
constexpr double kUncertainRad = RadFromDeg(3);  // of the weakest turn
constexpr size_t kSmallVoxels = 100;             // a bone so small is never known much better
constexpr double kSure = 3.0;                    // standard deviations
constexpr double kCautionRad = RadFromDeg(1.5);  // what a bone's turn should be right to ...
constexpr size_t kCautionVoxels = 300;           // ... unless it is smaller: then its surface counts alone
constexpr double kCautionVoxel = 0.5;            // what its surface should be right to

void Doubt(BoneFit& fit, const std::string& note) {
  fit.doubtful = true;
  fit.note = note + "; check it and give an initial pose for this bone if it is wrong";
}

// How far a turn about the least sure axis moves the bone's surface, mm a radian.
double LeverMm(const Bone& bone, const Eigen::Vector3d& axis) {
  double lever = 0;
  for (int a = 0; a < 3; ++a)
    lever = std::max(lever, 0.5 * bone.box.extent_mm[a] * bone.box.axes.col(a).cross(axis).norm());
  return lever;
}

Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> Turns(const BoneFit& fit) {
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(fit.covariance.topLeftCorner<3, 3>());
}

double SurfaceSdMm(const Bone& bone, const BoneFit& fit) {
  return std::max(WeakestTurnRad(fit) * LeverMm(bone, Turns(fit).eigenvectors().col(2)), CentreSdMm(fit));
}

// Names what the joint or the bone's own evidence speaks against.
void Judge(const BoneSet& bones, int b, double oddness, BoneFit& fit) {
  const Bone& bone = bones.bones[b];
  if (fit.doubtful) return;
  if (oddness > kOdd) {
    Doubt(fit, "bone '" + bone.name + "' stands to '" + bones.bones[bone.parent].name +
                   "' in a way that the other scans do not lead to expect");
  } else if (bone.voxels >= kSmallVoxels && WeakestTurnRad(fit) > kUncertainRad) {
    Doubt(fit, "how bone '" + bone.name + "' is turned about itself is known to some degrees only");
  } else if (bone.voxels >= kCautionVoxels && kSure * WeakestTurnRad(fit) > kCautionRad) {
    fit.note = "how bone '" + bone.name +
               "' is turned about itself may be off by more than a degree; look before relying on it";
  } else if (kSure * SurfaceSdMm(bone, fit) > kCautionVoxel * bones.labels.grid.MeanSpacingMm()) {
    fit.note = "the surface of bone '" + bone.name +
               "' may lie more than half a voxel off; look before relying on it";
  }
}

}  // namespace

double WeakestTurnRad(const BoneFit& fit) { return std::sqrt(std::max(0.0, Turns(fit).eigenvalues()[2])); }

double CentreSdMm(const BoneFit& fit) {
  return std::sqrt(std::max(0.0, fit.covariance.bottomRightCorner<3, 3>().trace()));
}

std::vector<Digest> SettleBones::Inputs::Keys() const {
  std::vector<Digest> keys{bones.key};
  for (const Artifact<BoneFits>& scan : fits) keys.push_back(scan.key);
  return keys;
}

std::vector<BoneFits> SettleBones::Run(const Inputs& inputs, const Options& options, StageContext&) {
  const BoneSet& bones = *inputs.bones;
  const std::vector<JointPlan> plans = PlanJoints(bones, options.region, options.joints);
  std::vector<const BoneFits*> measured;
  for (const Artifact<BoneFits>& scan : inputs.fits) measured.push_back(&*scan);
  const SettledPoses settled(bones, plans, measured);
  std::vector<BoneFits> out;
  for (size_t k = 0; k < measured.size(); ++k) {
    out.push_back(settled.Scan(k));
    for (int b = 0; b < bones.size(); ++b) Judge(bones, b, settled.Oddness(k, b), out[k][b]);
  }
  return out;
}

}  // namespace kvx
