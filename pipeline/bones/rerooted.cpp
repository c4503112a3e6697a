// Reverses the way from the new root to the old one, then lists parents before children.
#include "pipeline/bones/rerooted.h"

namespace kvx {

Rerooted RootedAt(const BoneSet& bones, int root) {
  std::vector<int> parent;
  for (const Bone& bone : bones.bones) parent.push_back(bone.parent);
  for (int b = root, above = kNoParent; b != kNoParent;) {
    const int next = parent[size_t(b)];
    parent[size_t(b)] = above;
    above = b, b = next;
  }
  Rerooted out;
  out.bones.labels = bones.labels;
  std::vector<int> place(parent.size(), kNoParent);  // in the new order
  out.order.push_back(root);
  for (size_t n = 0; n < out.order.size(); ++n) {
    const int b = out.order[n];
    place[size_t(b)] = int(n);
    Bone bone = bones.bones[size_t(b)];
    bone.parent = n == 0 ? kNoParent : place[size_t(parent[size_t(b)])];
    out.bones.bones.push_back(std::move(bone));
    for (int child = 0; child < bones.size(); ++child) {
      if (parent[size_t(child)] == b) out.order.push_back(child);
    }
  }
  return out;
}

}  // namespace kvx
