// Stage: the bones of one scan refined together at the scan's own voxels,
// with the spread of every estimate (eq. 1 with skinned surroundings).
#pragma once
#include "pipeline/bones/template/bone_template.h"
#include "pipeline/runner.h"

namespace kvx {

struct RefineBones {
  static constexpr std::string_view kName = "refine_bones";
  static constexpr int kVersion = 12;
  struct Inputs {
    BoneTemplate& shown;
    const Artifact<Scan>& scan;
    const Artifact<BoneFits>& fits;  // of RegisterBones
    std::vector<Digest> Keys() const {
      return {shown.scan().key, shown.bones().key, shown.weights().key, scan.key, fits.key};
    }
  };
  using Options = NoOptions;
  // With covariances; doubtful bones as they were found. All are doubtful where the scan shows them in
  // another size.
  using Output = BoneFits;
  static Output Run(const Inputs& inputs, const Options&, StageContext& context);
};

}  // namespace kvx
