// Stage `register_bones`: every bone of the template found in one scan (eq. 1), walking the tree from the
// root, without manual guidance.
#pragma once
#include <map>

#include "pipeline/bones/template/bone_template.h"
#include "pipeline/runner.h"

namespace kvx {

struct RegisterBones {
  static constexpr std::string_view kName = "register_bones";
  static constexpr int kVersion = 22;
  struct Inputs {
    BoneTemplate& shown;  // weights are not asked for
    const Artifact<Scan>& scan;
    std::vector<Digest> Keys() const { return {shown.scan().key, shown.bones().key, scan.key}; }
  };
  struct Options {
    std::map<std::string, RigidTransform>
        initial_poses;  // hints by bone name, scan_from_template; never a requirement
  };
  using Output = BoneFits;  // index as in BoneSet
  static Output Run(const Inputs& inputs, const Options& options, StageContext& context);
};
template <class A>
void Fields(A& a, RegisterBones::Options& v) {
  a(v.initial_poses);
}

}  // namespace kvx
