// Stage: what all scans together say about their bones. Joints turn much alike in every scan; where a
// scan's own evidence is weak (the turn of a round bone about its long axis), they decide.
#pragma once
#include "pipeline/runner.h"

namespace kvx {

struct SettleBones {
  static constexpr std::string_view kName = "settle_bones";
  static constexpr int kVersion = 13;
  struct Inputs {
    const Artifact<BoneSet>& bones;
    const std::vector<Artifact<BoneFits>>& fits;  // of RefineBones: every scan but the template
    std::vector<Digest> Keys() const;
  };
  struct Options {
    Region region = Region::kCustom;
    std::vector<StudyJoint> joints;
  };
  // Per scan its fits: poses and covariances after the joints' say; doubtful bones stay as they were found.
  using Output = std::vector<BoneFits>;
  static Output Run(const Inputs& inputs, const Options& options, StageContext& context);
};
template <class A>
void Fields(A& a, SettleBones::Options& v) {
  a(v.region, v.joints);
}

// Stage: one scan of them, as the stages of that scan take it.
struct ScanBones {
  static constexpr std::string_view kName = "scan_bones";
  static constexpr int kVersion = 1;
  struct Inputs {
    const Artifact<SettleBones::Output>& settled;
    std::vector<Digest> Keys() const { return {settled.key}; }
  };
  struct Options {
    int scan = 0;  // in the order of SettleBones::Inputs::fits
  };
  using Output = BoneFits;
  static Output Run(const Inputs& inputs, const Options& options, StageContext&) {
    return inputs.settled->at(size_t(options.scan));
  }
};
template <class A>
void Fields(A& a, ScanBones::Options& v) {
  a(v.scan);
}

}  // namespace kvx
