// Carries several hypotheses along the bone tree and lets the sum of evidence decide.
#pragma once
#include "core/host/progress.h"
#include "pipeline/bones/search/bone_search.h"

namespace kvx {

// Whether another pose explains the scan nearly as well.
bool HasRival(const Candidate& candidate);
// It matches, and without a rival.
bool Sure(const Candidate& found);

// Whether a search goes on where bones that make up half of all voxels are placed and hardly any is sure: the
// scan does not show the template's bones in this way, and of many ways that are tried only one may.
enum class Effort { kToTheEnd, kWhilePromising };

struct TreeFit {
  std::vector<Candidate> bones;  // index as in BoneSet; none if the search has been given up
  double nats = 0;               // evidence, joints and overlap of all bones
};

// Moves a bone to where its neighbours would have it if it fits clearly better near there. The place that it
// leaves stays a rival. `found`: one for every bone of the search.
void LookAgain(const BoneSearch& search, int bone, std::vector<Candidate>& found);

// Beam search, then each bone looked for once more with all its neighbours known.
TreeFit FindAllBones(const BoneSearch& search, Effort effort, const Progress& progress);

}  // namespace kvx
