// Joints are pairs of bones; a tree is a walk along them.
#include "pipeline/bones/template/search_tree.h"

#include <algorithm>
#include <numeric>
#include <utility>

#include "pipeline/bones/bone_set/bone_tree.h"
#include "pipeline/bones/bone_set/far_parents.h"

namespace kvx {
namespace {

constexpr size_t kSmallTimes = 4;  // a root so many times smaller than the largest bone is small

using Joints = std::vector<std::pair<int, int>>;

// From the root outwards; those that hang on one bone in the order of the bones.
SearchTree Walked(const BoneSet& bones, const Joints& joints, int root) {
  std::vector<std::vector<int>> beside(size_t(bones.size()));
  for (const auto& [a, b] : joints) beside[size_t(a)].push_back(b), beside[size_t(b)].push_back(a);
  SearchTree out;
  out.bones.labels = bones.labels;
  std::vector<int> parent{kNoParent};  // of each of `order`, in the new order
  out.order.push_back(root);
  for (size_t n = 0; n < out.order.size(); ++n) {
    const int b = out.order[n];
    Bone bone = bones.bones[size_t(b)];
    bone.parent = parent[n];
    out.bones.bones.push_back(std::move(bone));
    std::ranges::sort(beside[size_t(b)]);
    for (const int child : beside[size_t(b)]) {
      if (parent[n] != kNoParent && child == out.order[size_t(parent[n])]) continue;
      out.order.push_back(child), parent.push_back(int(n));
    }
  }
  return out;
}

Joints JointsOf(const BoneSet& bones) {
  Joints joints;
  for (int b = 0; b < bones.size(); ++b) {
    if (const int parent = bones.bones[size_t(b)].parent; parent != kNoParent) joints.push_back({parent, b});
  }
  return joints;
}

// Bones that hang together, directly or by others, have one number.
class Parts {
 public:
  explicit Parts(int bones) : part_(size_t(bones)) { std::iota(part_.begin(), part_.end(), 0); }
  bool Join(int a, int b) {  // whether they were apart
    const int from = part_[size_t(b)], to = part_[size_t(a)];
    std::ranges::replace(part_, from, to);
    return from != to;
  }
  int Of(int bone) const { return part_[size_t(bone)]; }

 private:
  std::vector<int> part_;
};

// Of what hangs together with `bone`, by `largest_first`.
int LargestBeside(int bone, const Parts& parts, const std::vector<int>& largest_first) {
  return *std::ranges::find(largest_first, parts.Of(bone), [&](int b) { return parts.Of(b); });
}

// Without those to `far`; what comes apart so is joined where it lies nearest. Over a gap that is no joint's,
// as between two limbs, the largest bones hold each other: they are found best.
Joints JoinedNearby(const BoneSet& bones, const BoneSurfaces& surfaces, const std::vector<FarParent>& far) {
  Joints joints;
  Parts parts(bones.size());
  for (const auto& [parent, b] : JointsOf(bones)) {
    if (std::ranges::find(far, b, &FarParent::bone) != far.end()) continue;
    joints.push_back({parent, b});
    parts.Join(parent, b);
  }
  std::vector<std::pair<double, std::pair<int, int>>> by_distance;
  for (int a = 0; a < bones.size(); ++a) {
    for (int b = a + 1; b < bones.size(); ++b) by_distance.push_back({surfaces.ApartMm(a, b), {a, b}});
  }
  std::ranges::sort(by_distance);
  const std::vector<int> largest_first = LargestFirst(bones);
  for (const auto& [apart_mm, pair] : by_distance) {
    auto [a, b] = pair;
    if (apart_mm > kFarMm)
      a = LargestBeside(a, parts, largest_first), b = LargestBeside(b, parts, largest_first);
    if (parts.Join(a, b)) joints.push_back({a, b});
  }
  return joints;
}

// The bone that a search best begins at, as all others hang on it.
int RootToSearchFrom(const BoneSet& bones) {
  const int largest = LargestFirst(bones).front();
  return bones.bones[size_t(largest)].voxels > kSmallTimes * bones.bones.front().voxels ? largest : 0;
}

}  // namespace

SearchTree RootedAt(const BoneSet& bones, int root) { return Walked(bones, JointsOf(bones), root); }

std::optional<SearchTree> TreeToSearch(const BoneSet& bones) {
  const int root = RootToSearchFrom(bones);
  const BoneSurfaces surfaces(bones);
  const std::vector<FarParent> far = FarParents(bones, surfaces);
  if (!far.empty()) return Walked(bones, JoinedNearby(bones, surfaces, far), root);
  return root == 0 ? std::nullopt : std::optional(RootedAt(bones, root));
}

BoneFits SearchTree::InOrder(const BoneFits& fits) const {
  BoneFits out(fits.size());
  for (size_t b = 0; b < fits.size(); ++b) out[size_t(order[b])] = fits[b];
  return out;
}

}  // namespace kvx
