// Settles all scans, then names what remains doubtful.
#include "pipeline/skeleton/settle_bones.h"

#include "pipeline/bones/judge/doubt_bone.h"
#include "pipeline/skeleton/bone_certainty.h"
#include "pipeline/skeleton/joint_model.h"

namespace kvx {
namespace {

constexpr double kOdd = 5.0;                    // standard deviations
constexpr double kDoubtfulRad = RadFromDeg(3);  // of the weakest turn
constexpr size_t kSmallVoxels = 100;            // a bone so small is never known much better

// How far off a bone may be that is known less than surely; empty of others.
std::string CautionOf(const Bone& bone, const BoneFit& fit, double voxel_mm) {
  const Certainty certainty = CertaintyOf(bone, fit, voxel_mm);
  if (certainty == Certainty::kSure) return {};
  return "the bone may be " + Text(BoundsOf(bone, fit)) +
         (certainty == Certainty::kCoarse ? ", as voxels and noise allow" : "; look before relying on it");
}

// Names what the joint or the bone's own evidence speaks against.
void Judge(const BoneSet& bones, int b, double oddness, BoneFit& fit) {
  const Bone& bone = bones.bones[b];
  if (fit.Doubtful()) return;
  if (oddness > kOdd) {
    DoubtBone(fit, "the bone stands to '" + bones.bones[bone.parent].name +
                       "' in a way that the other scans do not lead to expect");
  } else if (bone.voxels >= kSmallVoxels && WeakestTurnRad(fit) > kDoubtfulRad) {
    DoubtBone(fit, "how the bone is turned about itself is known to some degrees only");
  } else {
    fit.note = CautionOf(bone, fit, bones.labels.grid.MeanSpacingMm());
  }
}

}  // namespace

std::vector<Digest> SettleBones::Inputs::Keys() const {
  std::vector<Digest> keys{bones.key};
  for (const Artifact<BoneFits>& scan : fits) keys.push_back(scan.key);
  return keys;
}

std::vector<BoneFits> SettleBones::Run(const Inputs& inputs, const Options& options, StageContext&) {
  const BoneSet& bones = *inputs.bones;
  std::vector<JointPlan> plans = PlanJoints(bones, options.region, options.joints);
  // Strays are measured from what explains a joint's motion best, conjunct rotation and all.
  for (JointPlan& plan : plans) plan.conjunct_rotation = false;
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
