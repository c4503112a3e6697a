// Bricks with any node in the body or its margin get cells; their upper neighbours are stored for the nodes
// they share.
#include "pipeline/posing/brick_body.h"

#include <algorithm>
#include <atomic>
#include <cmath>
#include <stdexcept>

#include "core/grid_lines.h"
#include "core/parallel.h"
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

struct Around {
  int between, beside, sides;  // axes with tissue on both sides; sides with tissue; sides in the grid
};

Around AroundVoxel(const Mask& mask, const Eigen::Vector3i& at) {
  const Eigen::Vector3i n = mask.grid.size;
  const size_t strides[3] = {1, size_t(n.x()), size_t(n.x()) * n.y()},
               v = mask.grid.Index(at.x(), at.y(), at.z());
  Around around{0, 0, 0};
  for (int a = 0; a < 3; ++a) {
    const bool low = at[a] > 0 && mask.values[v - strides[a]] != 0;
    const bool high = at[a] + 1 < n[a] && mask.values[v + strides[a]] != 0;
    around.between += low && high, around.beside += low + high;
    around.sides += (at[a] > 0) + (at[a] + 1 < n[a]);
  }
  return around;
}

// Sets every voxel that `decide(is_tissue, around)` wants otherwise; returns whether there was one.
template <class Decide>
bool Change(Mask& mask, Decide decide) {
  const Mask before = mask;
  std::atomic<bool> changed = false;
  ParallelFor(size_t(mask.grid.size.z()), [&](size_t k) {
    size_t v = mask.grid.Index(0, 0, int(k));
    bool here = false;
    for (int j = 0; j < mask.grid.size.y(); ++j) {
      for (int i = 0; i < mask.grid.size.x(); ++i, ++v) {
        const bool now = decide(before.values[v] != 0, AroundVoxel(before, {i, j, int(k)}));
        here = here || now != (before.values[v] != 0);
        mask.values[v] = now;
      }
    }
    if (here) changed = true;
  });
  return changed;
}

// What has no air beside it, and what kernels/cl/evd_mend.cl would fill: it leaves the template alone.
// Beyond the grid nobody knows of air.
Mask InnerOf(Mask mask) {
  Change(mask, [](bool tissue, const Around& around) { return tissue && around.beside == around.sides; });
  while (Change(mask, [](bool tissue, const Around& around) { return tissue || around.between >= 2; })) {
  }
  return mask;
}

// Without what kernels/cl/evd_mend.cl would clear.
Mask BodyWith(const Mask& inner, Mask mask) {
  for (size_t v = 0; v < mask.values.size(); ++v) mask.values[v] = mask.values[v] || inner.values[v];
  Change(mask, [](bool tissue, const Around& around) { return tissue && around.beside > 0; });
  return mask;
}

size_t BrickIndex(const BrickedBody& b, const Eigen::Vector3i& brick) {
  return (size_t(brick.z()) * b.bricks.y() + brick.y()) * b.bricks.x() + brick.x();
}

// 2: has cells, 1: nodes only, 0: not stored.
std::vector<uint8_t> MarkBricks(const BrickedBody& b, const Mask& carried) {
  std::vector<uint8_t> mark(b.brick_at.size(), 0);
  const Eigen::Vector3i last_cell = b.bricks.array() - 2;
  for (size_t v = 0; v < carried.values.size(); ++v) {
    if (!carried.values[v]) continue;
    const Eigen::Vector3i node = carried.grid.Ijk(v);
    for (int corner = 0; corner < 8;
         ++corner) {  // a node on a brick's face belongs to the cells on both sides
      Eigen::Vector3i brick(node.x() >> 2, node.y() >> 2, node.z() >> 2);
      for (int a = 0; a < 3; ++a) brick[a] -= ((corner >> a) & 1) && (node[a] & 3) == 0;
      if ((brick.array() < 0).any() || (brick.array() > last_cell.array()).any()) continue;
      mark[BrickIndex(b, brick)] = 2;
    }
  }
  for (size_t i = mark.size(); i-- > 0;) {
    if (mark[i] != 2) continue;
    const Eigen::Vector3i at(int(i % b.bricks.x()), int(i / b.bricks.x() % b.bricks.y()),
                             int(i / b.bricks.x() / b.bricks.y()));
    for (int corner = 1; corner < 8; ++corner) {
      uint8_t& neighbour =
          mark[BrickIndex(b, at + Eigen::Vector3i(corner & 1, (corner >> 1) & 1, corner >> 2))];
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
      const int x = int(i % b.bricks.x()), y = int(i / b.bricks.x() % b.bricks.y()),
                z = int(i / b.bricks.x() / b.bricks.y());
      b.first_nodes.push_back({{4 * x, 4 * y, 4 * z, 0}});
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

void StoreWeights(BrickedBody& b, const WeightMap& map) {
  for (int brick = 0; brick < b.stored(); ++brick) {
    const size_t first = b.palette.size();
    b.palette_first.push_back(uint32_t(first));
    for (int n = 0; n < BrickedBody::kNodes; ++n) {
      const VoxelWeights& w = map.values[VoxelOf(b, map.grid, brick, n)];
      for (int s = 0; s < kBonesPerVoxel; ++s) {
        if (w.weights[s] == 0) continue;
        const size_t at = size_t(std::find(b.palette.begin() + long(first), b.palette.end(), w.bones[s]) -
                                 b.palette.begin());
        if (at == b.palette.size()) {
          b.palette.push_back(w.bones[s]);
          b.weights.resize(b.palette.size() * BrickedBody::kNodes, 0.0f);
        }
        b.weights[at * BrickedBody::kNodes + n] += w.weights[s];
      }
    }
  }
  b.palette_first.push_back(uint32_t(b.palette.size()));
  for (size_t at = 0; at < b.palette.size(); ++at) {
    const float* first = &b.weights[at * BrickedBody::kNodes];
    const auto [least, most] = std::minmax_element(first, first + BrickedBody::kNodes);
    b.weight_ranges.push_back(*least), b.weight_ranges.push_back(*most);
  }
}

// An example in the bricks where it is not zero.
struct BrickedExample {
  std::vector<int32_t> bricks;  // rising
  std::vector<float> scales;
  std::vector<int16_t> values;  // [brick][axis][node]
  std::vector<float> ranges;    // [brick]: least, greatest
};

void StoreBrick(const BrickedBody& b, int brick, const DisplacementField& example,
                const Eigen::Matrix3f& vox_from_mm, BrickedExample& out) {
  Eigen::Matrix<float, 3, BrickedBody::kNodes> d;
  for (int n = 0; n < BrickedBody::kNodes; ++n)
    d.col(n) = vox_from_mm * example.values[VoxelOf(b, example.grid, brick, n)];
  const float greatest = d.cwiseAbs().maxCoeff();
  if (!(greatest > 0)) return;
  const float scale = greatest / 32767.0f;
  out.bricks.push_back(brick), out.scales.push_back(scale);
  for (int a = 0; a < 3; ++a) out.ranges.push_back(d.row(a).minCoeff() - scale);  // rounding included
  for (int a = 0; a < 3; ++a) out.ranges.push_back(d.row(a).maxCoeff() + scale);
  for (int a = 0; a < 3; ++a) {
    for (int n = 0; n < BrickedBody::kNodes; ++n) out.values.push_back(int16_t(std::lround(d(a, n) / scale)));
  }
}

BrickedExample CutExample(const BrickedBody& b, const DisplacementField& example) {
  constexpr int kAtOnce = 1024;
  const Eigen::Matrix3f vox_from_mm = example.grid.VoxFromMm().cast<float>();
  std::vector<BrickedExample> parts(size_t((b.stored() + kAtOnce - 1) / kAtOnce));
  ParallelFor(parts.size(), [&](size_t n) {
    const int first = int(n) * kAtOnce, end = std::min(b.stored(), first + kAtOnce);
    for (int brick = first; brick < end; ++brick) StoreBrick(b, brick, example, vox_from_mm, parts[n]);
  });
  BrickedExample out;
  const auto append = [](auto& to, const auto& from) { to.insert(to.end(), from.begin(), from.end()); };
  for (const BrickedExample& part : parts) {
    append(out.bricks, part.bricks), append(out.scales, part.scales);
    append(out.values, part.values), append(out.ranges, part.ranges);
  }
  return out;
}

// The examples of every brick side by side.
void StoreExamples(BrickedBody& b, const std::vector<BrickedExample>& examples) {
  b.example_count = int(examples.size());
  std::vector<size_t> next(examples.size(), 0);
  for (int brick = 0; brick < b.stored(); ++brick) {
    b.example_first.push_back(uint32_t(b.example_refs.size()));
    for (size_t k = 0; k < examples.size(); ++k) {
      const BrickedExample& e = examples[k];
      const size_t n = next[k];
      if (n == e.bricks.size() || e.bricks[n] != brick) continue;
      constexpr size_t kValues = 3 * BrickedBody::kNodes;
      b.example_refs.push_back({int32_t(k), e.scales[n]});
      b.examples.insert(b.examples.end(), &e.values[n * kValues], &e.values[n * kValues] + kValues);
      b.example_ranges.insert(b.example_ranges.end(), &e.ranges[6 * n], &e.ranges[6 * n] + 6);
      ++next[k];
    }
  }
  b.example_first.push_back(uint32_t(b.example_refs.size()));
}

std::array<uint32_t, 12> TissueOf(const BrickedBody& b, const Mask& body, const Mask& carried,
                                  const Mask& inner, int brick) {
  std::array<uint32_t, 12> bits{};
  for (int n = 0; n < 125; ++n) {
    const Eigen::Vector3i node = b.FirstNode(brick) + Eigen::Vector3i(n % 5, n / 5 % 5, n / 25);
    if (!body.grid.Contains(node)) continue;
    const size_t v = body.grid.Index(node.x(), node.y(), node.z());
    bits[n >> 5] |= uint32_t(body.values[v] != 0) << (n & 31);
    bits[4 + (n >> 5)] |= uint32_t(carried.values[v] != 0) << (n & 31);
    bits[8 + (n >> 5)] |= uint32_t(inner.values[v] != 0) << (n & 31);
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
  BrickedBody b;
  for (int a = 0; a < 3; ++a)
    b.bricks[a] = (std::max(1, grid.size[a] - 1) + BrickedBody::kEdge - 1) / BrickedBody::kEdge + 1;
  b.brick_at.assign(size_t(b.bricks.x()) * b.bricks.y() * b.bricks.z(), -1);
  const Mask carried = WithMargin(tissue), inner = InnerOf(tissue), body = BodyWith(inner, tissue);
  NumberBricks(b, MarkBricks(b, carried));
  b.body.resize(size_t(b.stored()));
  b.tissue.resize(size_t(b.cell_bricks));
  ParallelEach(b.body.size(), [&](size_t n) { b.body[n] = BitsOf(body, b.FirstNode(int(n))); });
  ParallelEach(b.tissue.size(), [&](size_t n) { b.tissue[n] = TissueOf(b, body, carried, inner, int(n)); });
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
