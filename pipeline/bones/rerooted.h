// The same bones, walked from another one.
#pragma once
#include "core/pose.h"

namespace kvx {

struct Rerooted {
  BoneSet bones;           // parents first; parents between the two roots turned round
  std::vector<int> order;  // of each of `bones`, its index in the set they come from

  BoneFits InOrder(const BoneFits& fits) const;  // of `bones`, as in the set they come from
};
Rerooted RootedAt(const BoneSet& bones, int root);

// The bone that a search best begins at, as all others hang on it: the root (0), or, where that is small, as
// in a hand whose tree begins at a fingertip, the largest bone.
int RootToSearchFrom(const BoneSet& bones);

}  // namespace kvx
