// Reverses the way from the new root to the old one, then lists parents before children.
#include "pipeline/bones/rerooted.h"

#include "pipeline/bones/bone_tree.h"

namespace kvx {
namespace {

constexpr size_t kSmallTimes = 4;  // a root so many times smaller than the largest bone is small

}  // namespace

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

BoneFits Rerooted::InOrder(const BoneFits& fits) const {
  BoneFits out(fits.size());
  for (size_t b = 0; b < fits.size(); ++b) out[size_t(order[b])] = fits[b];
  return out;
}

int RootToSearchFrom(const BoneSet& bones) {
  const int largest = LargestFirst(bones).front();
  return bones.bones[size_t(largest)].voxels > kSmallTimes * bones.bones.front().voxels ? largest : 0;
}

}  // namespace kvx
