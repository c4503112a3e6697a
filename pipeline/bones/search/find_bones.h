// One search for all bones of a scan: along the tree, refined, and how far to trust each bone.
#pragma once
#include "core/host/progress.h"
#include "core/pose.h"
#include "pipeline/bones/search/hypothesis_tree.h"

namespace kvx {

struct FoundBones {
  BoneFits fits;                // index as in BoneSet; none if the search has been given up
  double sure_nats = 0;         // evidence for the bones that are not doubtful
  double sure_part = 0;         // of all bones' voxels, those of bones that are not doubtful
  double sure_correlation = 0;  // their mean, by voxels
};
FoundBones FindBones(const BoneSearch& search, Effort effort, const Progress& progress);

}  // namespace kvx
