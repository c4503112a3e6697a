// Node look-up and upload.
#include "kernels/bricked_body.h"

#include <algorithm>

#include "core/bone_of_label.h"
#include "core/host/parallel.h"
#include "core/voxels/to_corner.h"

namespace kvx {

int BrickedBody::BrickOf(const Eigen::Vector3i& node) const {
  const Eigen::Vector3i b(node.x() >> 2, node.y() >> 2, node.z() >> 2);
  if ((node.array() < 0).any() || (b.array() >= bricks.array()).any()) return -1;
  return brick_at[BrickIndex(b)];
}

bool BrickedBody::IsBody(const Eigen::Vector3i& node) const {
  const int brick = BrickOf(node);
  return brick >= 0 && ((body[brick] >> Slot(node)) & 1);
}

VoxelWeights BrickedBody::NodeWeights(int brick, int slot) const {
  std::array<std::pair<float, uint8_t>, kBonesPerVoxel> found{};
  size_t count = 0;
  for (uint32_t p = palette_first[brick]; p < palette_first[brick + 1]; ++p) {
    const float w = weights[size_t(p) * kNodes + slot];
    if (w != 0 && count < found.size()) found[count++] = {w, palette[p]};
  }
  std::stable_sort(found.begin(), found.begin() + count, [](auto& a, auto& b) { return a.first > b.first; });
  VoxelWeights out;
  for (size_t s = 0; s < count; ++s) out.weights[s] = found[s].first, out.bones[s] = found[s].second;
  return out;
}

namespace {

using BoneAtNode = std::array<int, 125>;  // of a brick with its upper neighbours' nodes

// The bone with most corners that is not `before`; 0 where there is none.
uint32_t BoneOfCorners(const std::array<int, 8>& corners, int before) {
  int most = 0;
  uint32_t found = 0;
  for (const int bone : corners) {
    const int count = int(std::ranges::count(corners, bone));
    if (bone == kNoBone || bone == before || count <= most) continue;
    most = count, found = uint32_t(bone) << 8;
    for (int n = 0; n < 8; ++n) found |= uint32_t(corners[n] == bone) << n;
  }
  return found;
}

uint32_t BoneCell(const BoneAtNode& bone_at, const Eigen::Vector3i& offset) {
  std::array<int, 8> corners;
  for (int n = 0; n < 8; ++n) {
    const Eigen::Vector3i at = offset + ToCorner(n);
    corners[n] = bone_at[(at.z() * 5 + at.y()) * 5 + at.x()];
  }
  const uint32_t first = BoneOfCorners(corners, kNoBone);
  return first | BoneOfCorners(corners, first ? int(first >> 8) : kNoBone) << 16;
}

}  // namespace

// The bone that a node of a brick with cells is in, which moves it alone.
int BrickedBody::BoneOf(int brick, const Eigen::Vector3i& offset) const {
  if (!IsBone(brick, offset)) return kNoBone;
  const Eigen::Vector3i node = FirstNode(brick) + offset;
  const int holder = BrickOf(node), slot = Slot(node);
  for (uint32_t p = palette_first[holder]; p < palette_first[holder + 1]; ++p)
    if (weights[size_t(p) * kNodes + slot] == 1) return palette[p];
  return kNoBone;
}

std::vector<uint32_t> BrickedBody::BoneCells() const {
  const Eigen::Vector3i size = kEdge * bricks;
  std::vector<uint32_t> cells(size_t(size.x()) * size.y() * size.z(), 0);
  ParallelEach(size_t(cell_bricks), [&](size_t brick) {
    if (std::all_of(tissue[brick].begin() + 12, tissue[brick].end(), [](uint32_t word) { return word == 0; }))
      return;
    BoneAtNode bone_at;
    for (int n = 0; n < 125; ++n) bone_at[n] = BoneOf(int(brick), {n % 5, n / 5 % 5, n / 25});
    for (int slot = 0; slot < kNodes; ++slot) {
      const Eigen::Vector3i node = FirstNode(int(brick)) + Offset(slot);
      cells[(size_t(node.z()) * size.y() + node.y()) * size.x() + node.x()] = BoneCell(bone_at, Offset(slot));
    }
  });
  return cells;
}

Eigen::Vector3d BrickedBody::NodeExample(size_t reference, int slot) const {
  const int16_t* d = &examples[reference * 3 * kNodes + slot];
  return double(example_refs[reference].scale) * Eigen::Vector3d(d[0], d[kNodes], d[2 * kNodes]);
}

namespace {

// Of a vector that ends with the count of what it points into.
bool Ascend(const std::vector<uint32_t>& first, size_t bricks, size_t count) {
  return first.size() == bricks + 1 && first.front() == 0 && first.back() == count &&
         std::ranges::is_sorted(first);
}

}  // namespace

// Each stored brick lies where its first node says, and all corners of one with cells are stored.
bool BrickedBody::HasConsistentBricks() const {
  const Eigen::Array3i n = bricks.array();
  if ((n < 0).any() || double(n[0]) * n[1] * n[2] != double(brick_at.size())) return false;
  if (cell_bricks < 0 || cell_bricks > stored()) return false;
  int64_t found = 0;
  for (size_t i = 0; i < brick_at.size(); ++i) {
    const int brick = brick_at[i];
    if (brick == -1) continue;
    const Eigen::Vector3i at = BrickPlace(i);
    if (brick < 0 || brick >= stored() || FirstNode(brick) != kEdge * at) return false;
    ++found;
    for (int corner = 1; corner < 8 && brick < cell_bricks; ++corner) {
      const Eigen::Vector3i beside = ToCorner(corner);
      if (BrickOf(kEdge * (at + beside)) < 0) return false;
    }
  }
  return found == stored();
}

bool BrickedBody::HasConsistentLists() const {
  const size_t nodes = size_t(stored()), cells = size_t(cell_bricks), bones = palette.size(),
               references = example_refs.size();
  return body.size() == nodes && tissue.size() == cells && cuts.size() == cells &&
         Ascend(palette_first, nodes, bones) && weights.size() == bones * kNodes &&
         weight_ranges.size() == 2 * bones && Ascend(example_first, nodes, references) &&
         examples.size() == references * 3 * kNodes && example_ranges.size() == 6 * references &&
         std::ranges::all_of(example_refs, [&](const Example& e) { return e.k >= 0 && e.k < example_count; });
}

bool BrickedBody::IsConsistent() const { return HasConsistentBricks() && HasConsistentLists(); }

DeviceBody::DeviceBody(Backend& backend, const BrickedBody& b)
    : brick_at(backend, b.brick_at),
      first_nodes(backend, b.first_nodes),
      body(backend, b.body),
      tissue(backend, b.tissue),
      cuts(backend, b.cuts),
      palette_first(backend, b.palette_first),
      palette(backend, b.palette),
      weights(backend, b.weights),
      weight_ranges(backend, b.weight_ranges),
      example_first(backend, b.example_first),
      example_refs(backend, b.example_refs),
      examples(backend, b.examples),
      example_ranges(backend, b.example_ranges),
      bricks{{b.bricks.x(), b.bricks.y(), b.bricks.z(), b.cell_bricks}},
      stored(b.stored()),
      bone_cells(backend, b.BoneCells()),
      bone_size{{b.kEdge * b.bricks.x(), b.kEdge * b.bricks.y(), b.kEdge * b.bricks.z(), 0}} {}

}  // namespace kvx
