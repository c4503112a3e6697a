// Settles all scans, hands out one of them.
#include "pipeline/skeleton/settle_bones.h"

#include <Eigen/Eigenvalues>
#include <cmath>

#include "pipeline/skeleton/joint_model.h"

namespace kvx {
namespace {

constexpr double kOdd = 5.0;                     // standard deviations
constexpr double kUncertainRad = RadFromDeg(3);  // of the weakest turn
constexpr size_t kSmallVoxels = 100;             // a bone so small is never known much better
// 1.5 degrees off is then two and a half standard deviations; stated ones come out up to a third too small.
constexpr double kCautionRad = RadFromDeg(0.6);
constexpr size_t kCautionVoxels = 300;  // smaller bones are seldom known so well

void Doubt(BoneFit& fit, const std::string& note) {
  fit.doubtful = true;
  fit.note = note + "; check it and give an initial pose for this bone if it is wrong";
}

}  // namespace

double WeakestTurnRad(const BoneFit& fit) {
  const Eigen::Matrix3d turn = fit.covariance.topLeftCorner<3, 3>();
  return std::sqrt(std::max(0.0, Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(turn).eigenvalues()[2]));
}

double CentreSdMm(const BoneFit& fit) {
  return std::sqrt(std::max(0.0, fit.covariance.bottomRightCorner<3, 3>().trace()));
}

std::vector<Digest> SettleBones::Inputs::Keys() const {
  std::vector<Digest> keys{bones.key};
  for (const Artifact<BoneFits>& scan : fits) keys.push_back(scan.key);
  return keys;
}

BoneFits SettleBones::Run(const Inputs& inputs, const Options& options, StageContext&) {
  const BoneSet& bones = *inputs.bones;
  const std::vector<JointPlan> plans = PlanJoints(bones, options.region, options.joints);
  std::vector<const BoneFits*> measured;
  for (const Artifact<BoneFits>& scan : inputs.fits) measured.push_back(&*scan);
  const SettledPoses settled(bones, plans, measured);
  BoneFits out = settled.Scan(size_t(options.scan));
  for (int b = 0; b < bones.size(); ++b) {
    const Bone& bone = bones.bones[b];
    if (out[b].doubtful) continue;
    if (settled.Oddness(size_t(options.scan), b) > kOdd) {
      Doubt(out[b], "bone '" + bone.name + "' stands to '" + bones.bones[bone.parent].name +
                        "' in a way that the other scans do not lead to expect");
    } else if (bone.voxels >= kSmallVoxels && WeakestTurnRad(out[b]) > kUncertainRad) {
      Doubt(out[b], "how bone '" + bone.name + "' is turned about itself is known to some degrees only");
    } else if (bone.voxels >= kCautionVoxels && WeakestTurnRad(out[b]) > kCautionRad) {
      out[b].note = "how bone '" + bone.name +
                    "' is turned about itself may be off by more than a degree; look before relying on it";
    }
  }
  return out;
}

}  // namespace kvx
