// A sentence about one label, to be read beside the bone's name.
#pragma once
#include <map>
#include <string>
#include <vector>

namespace kvx {

struct BoneDoubt {
  int label = 0;
  std::string text;  // what is doubtful, and what to do
};
template <class A>
void Fields(A& a, BoneDoubt& v) {
  a(v.label, v.text);
}

// A sentence once for all bones that it is of: "bones femur, 3: ...", by labels where `names` has none.
std::vector<std::string> Worded(const std::vector<BoneDoubt>& doubts,
                                const std::map<int, std::string>& names);

}  // namespace kvx
