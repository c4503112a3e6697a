// The bones a study lists, checked and put in order: parents before children.
#pragma once
#include <vector>

#include "core/bone.h"
#include "core/study.h"

namespace kvx {

// Labels, names and parents only, in the list's order as far as parents-first allows. Throws InputError: an
// empty list, a label outside 1..65535 or used twice, a name used twice or empty, a parent that is not
// listed, two roots, a cycle.
std::vector<Bone> OrderedBones(const std::vector<StudyBone>& listed);

// Indices of all bones, the one of most voxels first.
std::vector<int> LargestFirst(const BoneSet& bones);

}  // namespace kvx
