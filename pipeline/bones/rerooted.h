// The same bones, walked from another one.
#pragma once
#include "core/bone.h"

namespace kvx {

struct Rerooted {
  BoneSet bones;           // parents first; parents between the two roots turned round
  std::vector<int> order;  // of each of `bones`, its index in the set they come from
};
Rerooted RootedAt(const BoneSet& bones, int root);

}  // namespace kvx
