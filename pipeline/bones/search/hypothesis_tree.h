// Carries several hypotheses along the bone tree and lets the sum of evidence decide.
#pragma once
#include "core/progress.h"
#include "pipeline/bones/search/bone_search.h"

namespace kvx {

struct TreeFit {
  std::vector<Candidate> bones;  // index as in BoneSet
  double nats = 0;               // evidence, joints and overlap of all bones
};

// Beam search, then each bone looked for once more with all its neighbours known.
TreeFit FindAllBones(const BoneSearch& search, const Progress& progress);

}  // namespace kvx
