// A second search for bones that the first one lost.
#pragma once
#include "pipeline/bones/search/bone_search.h"

namespace kvx {

PartialPose Placed(const std::vector<Candidate>& found);

// Bones were looked for from parents that were known roughly. Now that parents lie to a fraction of a voxel,
// whatever is lost is looked for once more, parents first: who was lost with its parent is found with it.
// Other lost bones do not stand in the way. A bone that must be in view, as its parent is and would carry it
// there, is nowhere where it hardly matches; of others a weak match says nothing.
// `found`: one for every bone of the search, all with a pose; the root is left as it is.
void FindTheLost(const BoneSearch& search, std::vector<Candidate>& found);

}  // namespace kvx
