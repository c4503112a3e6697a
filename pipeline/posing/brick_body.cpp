// Bricks with any node in the body or its margin get cells; their upper neighbours are stored for the nodes
// they share.
#include "pipeline/posing/brick_body.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <stdexcept>

#include "core/host/parallel.h"
#include "core/voxels/grid_lines.h"
#include "core/voxels/to_corner.h"
#include "pipeline/posing/find_cuts.h"

namespace kvx {
namespace {

// Grown by `reach` voxels along one axis.
void GrowAlong(Mask& mask, int axis, int reach) {
  const GridLines lines(mask.grid, axis);
  const size_t stride = lines.stride;
  const int length = lines.length;
  ParallelRanges(lines.count, [&](size_t begin, size_t end) {
    std::vector<uint8_t> line(length);
    for (size_t l = begin; l < end; ++l) {
      const size_t first = lines.First(l);
      for (int i = 0; i < length; ++i) line[i] = mask.values[first + i * stride];
      for (int i = 0, until = -1; i < length + reach; ++i) {
        if (i < length && line[i]) until = i + 2 * reach;
        if (i >= reach) mask.values[first + (i - reach) * stride] = i <= until;
      }
    }
  });
}

Mask WithMargin(Mask mask) {
  for (int axis = 0; axis < 3; ++axis) GrowAlong(mask, axis, kMarginVoxels);
  return mask;
}

// Of a voxel. In bytes, of which a processor takes many at once.
struct Around {
  uint8_t between, beside, sides;  // axes with tissue on both sides; sides with tissue; sides in the grid
};

// The rows beside the rows of a mask, for one slice.
class RowsAround {
 public:
  RowsAround(const Mask& mask, int slice)
      : mask_(mask),
        k_(slice),
        none_(size_t(mask.grid.size.x()), 0),
        own_(none_.size() + 2, 0),
        sides_(none_.size(), 2) {
    --sides_.front(), --sides_.back();
  }
  // Sets all of row `j` that `decide(is_tissue, around)` wants otherwise, in `out`; returns whether there was
  // one.
  template <class Decide>
  bool Change(int j, const Decide& decide, uint8_t* out) {
    const Eigen::Vector3i& size = mask_.grid.size;
    const size_t length = none_.size();
    std::copy_n(&mask_(0, j, k_), length, own_.begin() + 1);
    const uint8_t *const before_x = own_.data(), *const own = before_x + 1, *const after_x = own + 1,
                         *const sides_x = sides_.data();
    const uint8_t *const before_y = j > 0 ? &mask_(0, j - 1, k_) : none_.data(),
                         *const after_y = j + 1 < size.y() ? &mask_(0, j + 1, k_) : none_.data(),
                         *const before_z = k_ > 0 ? &mask_(0, j, k_ - 1) : none_.data(),
                         *const after_z = k_ + 1 < size.z() ? &mask_(0, j, k_ + 1) : none_.data();
    const auto sides = uint8_t((j > 0) + (j + 1 < size.y()) + (k_ > 0) + (k_ + 1 < size.z()));
    uint8_t changed = 0;
    for (size_t i = 0; i < length; ++i) {
      const uint8_t x = before_x[i] + after_x[i], y = before_y[i] + after_y[i], z = before_z[i] + after_z[i];
      const Around around{uint8_t((x >> 1) + (y >> 1) + (z >> 1)), uint8_t(x + y + z),
                          uint8_t(sides + sides_x[i])};
      const uint8_t now = decide(own[i], around);
      changed |= now ^ own[i];
      out[i] = now;
    }
    return changed != 0;
  }

 private:
  const Mask& mask_;
  int k_;
  std::vector<uint8_t> none_, own_, sides_;  // own_: with one voxel more at both ends
};

// Sets every voxel that `decide(is_tissue, around)` wants otherwise; returns whether there was one.
template <class Decide>
bool Change(Mask& mask, const Decide& decide) {
  const Mask before = mask;
  std::atomic<bool> changed = false;
  ParallelFor(size_t(mask.grid.size.z()), [&](size_t k) {
    RowsAround rows(before, int(k));
    bool here = false;
    for (int j = 0; j < mask.grid.size.y(); ++j) here |= rows.Change(j, decide, &mask(0, j, int(k)));
    if (here) changed = true;
  });
  return changed;
}

// What has no air beside it, and what kernels/cl/evd_mend.cl would fill: it leaves the template alone.
// Beyond the grid nobody knows of air.
Mask InnerOf(Mask mask) {
  Change(mask, [](uint8_t tissue, const Around& around) { return tissue & (around.beside == around.sides); });
  while (Change(mask, [](uint8_t tissue, const Around& around) { return tissue | (around.between >= 2); })) {
  }
  return mask;
}

// Without what kernels/cl/evd_mend.cl would clear.
Mask BodyWith(const Mask& inner, Mask mask) {
  ParallelEach(mask.values.size(), [&](size_t v) { mask.values[v] = mask.values[v] || inner.values[v]; });
  Change(mask, [](uint8_t tissue, const Around& around) { return tissue & (around.beside > 0); });
  return mask;
}

// Whether a corner of one of the brick's cells is in the mask.
bool HasNodeIn(const Mask& mask, const Eigen::Vector3i& brick) {
  const Eigen::Vector3i first = BrickedBody::kEdge * brick;
  const Eigen::Vector3i last = (first.array() + BrickedBody::kEdge).min(mask.grid.size.array() - 1).matrix();
  for (int k = first.z(); k <= last.z(); ++k) {
    for (int j = first.y(); j <= last.y(); ++j) {
      for (int i = first.x(); i <= last.x(); ++i)
        if (mask(i, j, k)) return true;
    }
  }
  return false;
}

// 2: has cells, 1: nodes only, 0: not stored.
std::vector<uint8_t> MarkBricks(const BrickedBody& b, const Mask& carried) {
  std::vector<uint8_t> mark(b.brick_at.size(), 0);
  const Eigen::Array3i last_cell = b.bricks.array() - 2;
  ParallelEach(mark.size(), [&](size_t i) {
    const Eigen::Vector3i at = b.BrickPlace(i);
    if ((at.array() <= last_cell).all() && HasNodeIn(carried, at)) mark[i] = 2;
  });
  for (size_t i = mark.size(); i-- > 0;) {
    if (mark[i] != 2) continue;
    const Eigen::Vector3i at = b.BrickPlace(i);
    for (int corner = 1; corner < 8; ++corner) {
      uint8_t& neighbour = mark[b.BrickIndex(at + ToCorner(corner))];
      neighbour = std::max<uint8_t>(neighbour, 1);
    }
  }
  return mark;
}

void NumberBricks(BrickedBody& b, const std::vector<uint8_t>& mark) {
  for (const int wanted : {2, 1}) {
    for (size_t i = 0; i < mark.size(); ++i) {
      if (mark[i] != wanted) continue;
      b.brick_at[i] = b.stored();
      const Eigen::Vector3i first = BrickedBody::kEdge * b.BrickPlace(i);
      b.first_nodes.push_back({{first.x(), first.y(), first.z(), 0}});
    }
    if (wanted == 2) b.cell_bricks = b.stored();
  }
}

uint64_t BitsOf(const Mask& mask, const Eigen::Vector3i& first) {
  uint64_t bits = 0;
  for (int n = 0; n < BrickedBody::kNodes; ++n) {
    const Eigen::Vector3i node = first + BrickedBody::Offset(n);
    if (mask.grid.Contains(node) && mask(node.x(), node.y(), node.z())) bits |= uint64_t(1) << n;
  }
  return bits;
}

// The voxel of a node; nodes beyond the grid take the nearest voxel.
size_t VoxelOf(const BrickedBody& b, const Grid& grid, int brick, int slot) {
  const Eigen::Vector3i node =
      (b.FirstNode(brick) + BrickedBody::Offset(slot)).cwiseMin(grid.size - Eigen::Vector3i::Ones());
  return grid.Index(node.x(), node.y(), node.z());
}

// Of some bricks in their order.
struct BrickedWeights {
  std::vector<uint32_t> bone_counts;  // per brick
  std::vector<uint8_t> palette;       // bones, brick by brick
  std::vector<float> weights;         // [palette][node]
};

void AddBrick(const BrickedBody& b, int brick, const WeightMap& map, BrickedWeights& out) {
  const size_t first = out.palette.size();
  for (int n = 0; n < BrickedBody::kNodes; ++n) {
    const VoxelWeights& w = map.values[VoxelOf(b, map.grid, brick, n)];
    for (int s = 0; s < kBonesPerVoxel; ++s) {
      if (w.weights[s] == 0) continue;
      const size_t at = size_t(std::find(out.palette.begin() + long(first), out.palette.end(), w.bones[s]) -
                               out.palette.begin());
      if (at == out.palette.size()) {
        out.palette.push_back(w.bones[s]);
        out.weights.resize(out.palette.size() * BrickedBody::kNodes, 0.0f);
      }
      out.weights[at * BrickedBody::kNodes + n] += w.weights[s];
    }
  }
  out.bone_counts.push_back(uint32_t(out.palette.size() - first));
}

void StoreWeights(BrickedBody& b, const WeightMap& map) {
  constexpr int kAtOnce = 1024;
  std::vector<BrickedWeights> parts(size_t((b.stored() + kAtOnce - 1) / kAtOnce));
  ParallelFor(parts.size(), [&](size_t n) {
    const int first = int(n) * kAtOnce, end = std::min(b.stored(), first + kAtOnce);
    for (int brick = first; brick < end; ++brick) AddBrick(b, brick, map, parts[n]);
  });
  b.palette_first.push_back(0);
  for (const BrickedWeights& part : parts) {
    for (const uint32_t bones : part.bone_counts) b.palette_first.push_back(b.palette_first.back() + bones);
    b.palette.insert(b.palette.end(), part.palette.begin(), part.palette.end());
  }
  b.weights.resize(b.palette.size() * BrickedBody::kNodes);
  b.weight_ranges.resize(2 * b.palette.size());
  ParallelEach(parts.size(), [&](size_t n) {
    const size_t at = b.palette_first[n * kAtOnce];
    std::ranges::copy(parts[n].weights, b.weights.begin() + long(at * BrickedBody::kNodes));
    for (size_t p = 0; p < parts[n].palette.size(); ++p) {
      const float* first = &parts[n].weights[p * BrickedBody::kNodes];
      const auto [least, most] = std::minmax_element(first, first + BrickedBody::kNodes);
      b.weight_ranges[2 * (at + p)] = *least, b.weight_ranges[2 * (at + p) + 1] = *most;
    }
  });
}

constexpr size_t kValuesPerBrick = 3 * BrickedBody::kNodes, kRangesPerBrick = 6;

// An example in all stored bricks.
struct BrickedExample {
  explicit BrickedExample(size_t bricks)
      : scales(bricks), values(kValuesPerBrick * bricks), ranges(kRangesPerBrick * bricks) {}
  std::vector<float> scales;    // 0: nothing moves
  std::vector<int16_t> values;  // [brick][axis][node]
  std::vector<float> ranges;    // [brick]: least, greatest
};

void CutBrick(const BrickedBody& b, int brick, const DisplacementField& example,
              const Eigen::Matrix3f& vox_from_mm, BrickedExample& out) {
  Eigen::Matrix<float, 3, BrickedBody::kNodes> d;
  for (int n = 0; n < BrickedBody::kNodes; ++n)
    d.col(n) = vox_from_mm * example.values[VoxelOf(b, example.grid, brick, n)];
  const float greatest = d.cwiseAbs().maxCoeff();
  if (!(greatest > 0)) return;
  const float scale = greatest / 32767.0f;
  out.scales[size_t(brick)] = scale;
  float* const range = &out.ranges[kRangesPerBrick * size_t(brick)];
  int16_t* const value = &out.values[kValuesPerBrick * size_t(brick)];
  for (int a = 0; a < 3; ++a) {
    range[a] = d.row(a).minCoeff() - scale;  // rounding included
    range[3 + a] = d.row(a).maxCoeff() + scale;
    for (int n = 0; n < BrickedBody::kNodes; ++n)
      value[a * BrickedBody::kNodes + n] = int16_t(std::lround(d(a, n) / scale));
  }
}

BrickedExample CutExample(const BrickedBody& b, const DisplacementField& example) {
  const Eigen::Matrix3f vox_from_mm = example.grid.VoxFromMm().cast<float>();
  BrickedExample out(size_t(b.stored()));
  ParallelEach(out.scales.size(), [&](size_t n) { CutBrick(b, int(n), example, vox_from_mm, out); });
  return out;
}

// The examples of every brick side by side, where they are not zero.
void StoreExamples(BrickedBody& b, const std::vector<BrickedExample>& examples) {
  b.example_count = int(examples.size());
  const size_t bricks = size_t(b.stored());
  for (size_t brick = 0; brick < bricks; ++brick) {
    b.example_first.push_back(uint32_t(b.example_refs.size()));
    for (size_t k = 0; k < examples.size(); ++k) {
      const float scale = examples[k].scales[brick];
      if (scale > 0) b.example_refs.push_back({int32_t(k), scale});
    }
  }
  b.example_first.push_back(uint32_t(b.example_refs.size()));
  b.examples.resize(kValuesPerBrick * b.example_refs.size());
  b.example_ranges.resize(kRangesPerBrick * b.example_refs.size());
  ParallelEach(bricks, [&](size_t brick) {
    for (uint32_t ref = b.example_first[brick]; ref < b.example_first[brick + 1]; ++ref) {
      const BrickedExample& e = examples[size_t(b.example_refs[ref].k)];
      std::copy_n(&e.values[kValuesPerBrick * brick], kValuesPerBrick, &b.examples[kValuesPerBrick * ref]);
      std::copy_n(&e.ranges[kRangesPerBrick * brick], kRangesPerBrick,
                  &b.example_ranges[kRangesPerBrick * ref]);
    }
  });
}

BrickedBody::Tissue TissueOf(const BrickedBody& b, const Mask& body, const Mask& carried, const Mask& inner,
                             const LabelMap& bones, int brick) {
  BrickedBody::Tissue bits{};
  for (int n = 0; n < 125; ++n) {
    const Eigen::Vector3i node = b.FirstNode(brick) + Eigen::Vector3i(n % 5, n / 5 % 5, n / 25);
    if (!body.grid.Contains(node)) continue;
    const size_t v = body.grid.Index(node.x(), node.y(), node.z());
    bits[n >> 5] |= uint32_t(body.values[v] != 0) << (n & 31);
    bits[4 + (n >> 5)] |= uint32_t(carried.values[v] != 0) << (n & 31);
    bits[8 + (n >> 5)] |= uint32_t(inner.values[v] != 0) << (n & 31);
    bits[12 + (n >> 5)] |= uint32_t(bones.values[v] != 0) << (n & 31);
  }
  return bits;
}

void RequireSameGrid(const Grid& a, const Grid& b) {
  if (!(a == b)) throw std::logic_error("the posing engine's inputs lie on different grids");
}

}  // namespace

BrickedBody BrickBody(const PosingInputs& in) {
  RequireSameGrid(in.template_scan.volume.grid, in.body.grid);
  return BrickBody(in.body, in.bones, in.weights, in.examples.size(), [&](size_t k) {
    return std::shared_ptr<const DisplacementField>(std::shared_ptr<void>(), in.examples[k]);  // not ours
  });
}

BrickedBody BrickBody(const Mask& tissue, const BoneSet& bones, const WeightMap& weights, size_t examples,
                      const ExampleLoader& example) {
  const Grid& grid = tissue.grid;
  RequireSameGrid(grid, weights.grid);
  RequireSameGrid(grid, bones.labels.grid);
  BrickedBody b;
  for (int a = 0; a < 3; ++a)
    b.bricks[a] = (std::max(1, grid.size[a] - 1) + BrickedBody::kEdge - 1) / BrickedBody::kEdge + 1;
  b.brick_at.assign(size_t(b.bricks.x()) * b.bricks.y() * b.bricks.z(), -1);
  const Mask carried = WithMargin(tissue), inner = InnerOf(tissue), body = BodyWith(inner, tissue);
  NumberBricks(b, MarkBricks(b, carried));
  b.body.resize(size_t(b.stored()));
  b.tissue.resize(size_t(b.cell_bricks));
  ParallelEach(b.body.size(), [&](size_t n) { b.body[n] = BitsOf(body, b.FirstNode(int(n))); });
  ParallelEach(b.tissue.size(),
               [&](size_t n) { b.tissue[n] = TissueOf(b, body, carried, inner, bones.labels, int(n)); });
  b.cuts = FindCuts(b, bones, weights);
  StoreWeights(b, weights);
  std::vector<BrickedExample> bricked;
  for (size_t k = 0; k < examples; ++k) {
    const std::shared_ptr<const DisplacementField> d = example(k);
    RequireSameGrid(grid, d->grid);
    bricked.push_back(CutExample(b, *d));
  }
  StoreExamples(b, bricked);
  return b;
}

}  // namespace kvx
