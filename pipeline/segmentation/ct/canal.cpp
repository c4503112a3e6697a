// A large bone is looked at on blocks of voxels.
#include "pipeline/segmentation/ct/canal.h"

#include <algorithm>
#include <array>
#include <vector>

#include "core/voxels/components.h"
#include "core/voxels/dilated.h"
#include "core/voxels/label_mask.h"
#include "core/voxels/neighbours.h"
#include "pipeline/scans/coarser.h"
#include "pipeline/segmentation/ct/ct_outside.h"

namespace kvx {
namespace {

constexpr float kSoftHu = 60;
constexpr float kFatHu = -30;        // less in the mean: marrow of a shaft
constexpr double kBallMm = 3;        // of radius: does not fit into spongy bone's gaps
constexpr double kLeast = 0.03;      // of the bone
constexpr double kOpen = 0.1;        // of the part's surface; of a bone's soft parts 0.04 are the rule
constexpr size_t kHardlyMarked = 2;  // voxels of strokes
constexpr size_t kMostBlocks = 2'000'000;

struct Part {
  size_t voxels = 0, marked = 0;
  double sum_hu = 0, surface_mm2 = 0, open_mm2 = 0;
  std::array<double, 6> cut_mm2{};  // by the view

  double CutMm2() const {  // through and through
    double cut = 0;
    for (size_t way = 0; way < 6; way += 2)
      if (std::min(cut_mm2[way], cut_mm2[way + 1]) > 0) cut += cut_mm2[way] + cut_mm2[way + 1];
    return sum_hu > kFatHu * double(voxels) ? cut : 0;
  }
  bool IsCanal(size_t voxels_of_bone) const {
    return double(voxels) >= kLeast * double(voxels_of_bone) && marked <= kHardlyMarked &&
           open_mm2 + CutMm2() >= kOpen * surface_mm2;
  }
};

class SoftParts {
 public:
  SoftParts(const Volume& hu, const LabelMap& labels, const LabelMap& strokes, int label)
      : hu_(hu), bone_(MaskOfLabel(labels, label)), soft_(hu.grid) {
    for (size_t v = 0; v < hu.values.size(); ++v) soft_.values[v] = hu.values[v] < kSoftHu;
    pieces_ = LabelComponents(WideParts());
    parts_.resize(pieces_.voxels.size());
    for (size_t v = 0; v < hu.values.size(); ++v)
      if (pieces_.piece.values[v] >= 0) Add(v, strokes.values[v] == label);
  }
  bool AnyIsCanal() const {
    const auto voxels = size_t(std::ranges::count(bone_.values, 1));
    return std::ranges::any_of(parts_, [&](const Part& part) { return part.IsCanal(voxels); });
  }

 private:
  // Of the bone's soft voxels those that such a ball gets to, its middle in the bone, too.
  Mask WideParts() const {
    Mask wide = Eroded(soft_, kBallMm);
    for (size_t v = 0; v < wide.values.size(); ++v) wide.values[v] &= bone_.values[v];
    wide = Dilated(wide, kBallMm);
    for (size_t v = 0; v < wide.values.size(); ++v) wide.values[v] &= bone_.values[v] & soft_.values[v];
    return wide;
  }

  void Add(size_t v, bool marked) {
    const int32_t piece = pieces_.piece.values[v];
    Part& part = parts_[size_t(piece)];
    ++part.voxels, part.marked += marked, part.sum_hu += hu_.values[v];
    const Grid& grid = hu_.grid;
    const Eigen::Vector3i p = grid.Ijk(v);
    for (int way = 0; way < 6; ++way) {
      const int axis = way / 2;
      const Eigen::Vector3i q = p + StepToSide(way);
      const double face_mm2 = grid.spacing_mm.prod() / grid.spacing_mm[axis];
      const bool inside = grid.Contains(q);
      const size_t next = inside ? grid.Index(q.x(), q.y(), q.z()) : v;
      if (inside && pieces_.piece.values[next] == piece) continue;
      part.surface_mm2 += face_mm2;
      if (!inside)
        part.cut_mm2[size_t(way)] += face_mm2;
      else if (!bone_.values[next] && soft_.values[next] && hu_.values[next] > kThinnestHu)
        part.open_mm2 += face_mm2;
    }
  }

  const Volume& hu_;
  Mask bone_, soft_;
  Components pieces_;
  std::vector<Part> parts_;
};

}  // namespace

bool HoldsCanal(const Volume& scan_hu, const LabelMap& labels, const LabelMap& strokes, int label,
                const VoxelBox& box) {
  const VoxelBox around = box.Grown(Eigen::Vector3i::Constant(2), scan_hu.grid);
  const BlockedBox part{around, BlocksFor(around, scan_hu.grid, kMostBlocks).back()};
  return SoftParts(Coarser(scan_hu, part), Coarser(labels, part, label), Coarser(strokes, part, label), label)
      .AnyIsCanal();
}

}  // namespace kvx
