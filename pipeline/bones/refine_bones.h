// Stage: the bones of one scan refined together at the scan's own voxels,
// with the spread of every estimate (eq. 1 with skinned surroundings).
#pragma once
#include "pipeline/bones/refine/pose_hint.h"
#include "pipeline/bones/template/bone_template.h"
#include "pipeline/runner.h"

namespace kvx {

struct RefineBones {
  static constexpr std::string_view kName = "refine_bones";
  static constexpr int kVersion = 18;
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
  // With covariances; what is given as doubtful stays so, wherever near it the scan matches best. What would
  // go too far stays where it was found, as does what the scan hardly shows, and is doubtful; hints nearby
  // decide what the scan does not. All are where the scan shows them in another size.
  using Output = BoneFits;
  static Output Run(const Inputs& inputs, const Options& options, StageContext& context);
};
template <class A>
void Fields(A& a, RefineBones::Options& v) {
  a(v.initial_poses);
}

}  // namespace kvx
