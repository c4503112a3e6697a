// Names for the labels of a label map, by what the region's bones look like and how they hang together.
#pragma once
#include <vector>

#include "core/bone.h"
#include "core/proposed_bone.h"
#include "core/study.h"

namespace kvx {

// One entry per label, in the order of labels. Knee: the two long bones by what lies beside them and which is
// higher, the fibula by its slenderness. Hand: five chains of bones that start at the carpal block, the
// thumb's being the shortest. A region without preset, or more labels than its preset has bones: figures
// without names.
std::vector<ProposedBone> ProposeNames(const LabelMap& labels, Region region);

// False where the labels are some other tool's numbers: the root's is not among them, and most are beyond the
// preset's. `labels` are those that the map holds.
bool NumberedAsPreset(const std::vector<int>& labels, Region region);

// For labels that are numbers of the preset's bones, as those of strokes and finished label maps: the names
// that a model takes without bones.list. Where a bone looks like another one, that is said and costs
// confidence. Another tool's numbers say nothing: names as ProposeNames has them.
std::vector<ProposedBone> NamesByNumber(const LabelMap& labels, Region region);

// "label 3 may be fibula" for each name that is not sure, and what has none.
std::vector<std::string> NamesInDoubt(const std::vector<ProposedBone>& bones);

// "patella looks like fibula" for bones that have a name of the preset and surely look like another of its
// bones.
std::vector<std::string> LooksOtherwise(const BoneSet& bones, Region region);

// The named ones as bones.list; those whose parent has no voxels hang on its parent. Throws InputError when a
// name is in doubt.
std::vector<StudyBone> SurelyNamed(const std::vector<ProposedBone>& bones);

}  // namespace kvx
