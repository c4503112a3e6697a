// Stage: the bones of one scan refined together at the scan's own voxels,
// with the spread of every estimate (eq. 1 with skinned surroundings).
#pragma once
#include "pipeline/bones/refine/pose_hint.h"
#include "pipeline/bones/template/bone_template.h"
#include "pipeline/runner.h"

namespace kvx {

struct RefineBones {
  static constexpr std::string_view kName = "refine_bones";
  static constexpr int kVersion = 15;
  struct Inputs {
    BoneTemplate& shown;
    const Artifact<Scan>& scan;
    const Artifact<BoneFits>& fits;  // of RegisterBones
    std::vector<Digest> Keys() const {
      return {shown.scan().key, shown.bones().key, shown.weights().key, scan.key, fits.key};
    }
  };
  struct Options {
    PoseHints initial_poses;  // the same as RegisterBones had
  };
  // With covariances; doubtful bones as they were found, or between there and a hint nearby, by what the scan
  // decides. Doubtful is also what would go too far from where it was found, and all where the scan shows
  // them in another size.
  using Output = BoneFits;
  static Output Run(const Inputs& inputs, const Options& options, StageContext& context);
};
template <class A>
void Fields(A& a, RefineBones::Options& v) {
  a(v.initial_poses);
}

}  // namespace kvx
