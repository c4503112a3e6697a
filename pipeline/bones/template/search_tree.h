// The tree along which bones are looked for, where it is not the study's own.
#pragma once
#include <optional>

#include "core/pose.h"

namespace kvx {

struct SearchTree {
  BoneSet bones;           // parents first
  std::vector<int> order;  // of each of `bones`, its index in the set they come from

  BoneFits InOrder(const BoneFits& fits) const;  // of `bones`, as in the set they come from
};

// The same joints, walked from another bone: parents between the two roots are turned round.
SearchTree RootedAt(const BoneSet& bones, int root);

// A bone is looked for where its parent leaves it room, so parents are bones that it meets. Those that a
// study hangs on a bone far away (far_parents.h) hang on the nearest here, and other limbs by the largest
// bones; and all hang on the largest bone where the root is small, as in a hand whose tree begins at a
// fingertip. Nothing where the study's tree will do.
std::optional<SearchTree> TreeToSearch(const BoneSet& bones);

}  // namespace kvx
