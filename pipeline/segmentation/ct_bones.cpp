// Geodesic distances that pay for falls away from a bone and for rises into one give each voxel its lean; a
// minimum cut whose links are cheap where density falls outwards gives the border.
#include "pipeline/segmentation/ct_bones.h"

#include <algorithm>
#include <cmath>

#include "core/parallel.h"
#include "pipeline/segmentation/ct_outside.h"
#include "pipeline/segmentation/geodesic.h"
#include "pipeline/segmentation/stroke_remoteness.h"

namespace kvx {
namespace {

constexpr float kLowHu = 0,
                kHighHu = 600;  // fat is no less outside than muscle, metal no more bone than cortex
constexpr float kUnitHu = 400;  // of relative density
constexpr double kMarginMm = 10, kMarginOfDiagonal = 0.35;
constexpr int kMostGrowth = 2;
constexpr double kDiagonalsPerUnit = 10;  // what a fall by one unit costs, in diagonals of the strokes' box
constexpr float kOutsideHandicap = 2;     // the outside's marks are many and near, a bone's few
constexpr float kRemoteLean = 0.2f;       // how much of a bone's lean may be lost far from its strokes
constexpr float kBoneHu = 150, kBoneScaleHu = 50;  // for sure, with a say of one nat per scale
constexpr double kBoneNats = 2, kSoftNats = 0.3;   // most say: marrow looks like soft tissue
constexpr double kLeanNats = 3, kLinkNats = 6;
constexpr double kLeastEdgeHu = 60;

// Of what neighbours along i in soft tissue differ by, the normal deviation of one voxel.
double NoiseHu(const Volume& scan_hu) {
  constexpr float kSoftLowHu = -200, kSoftHighHu = 150;
  constexpr double kUsual = 20, kLeast = 10, kMost = 60;
  constexpr size_t kEnough = 100;
  const auto soft = [](float hu) { return hu > kSoftLowHu && hu < kSoftHighHu; };
  std::vector<float> changes;
  for (size_t v = 0; v + 1 < scan_hu.values.size(); ++v) {
    if ((v + 1) % size_t(scan_hu.grid.size.x()) == 0) continue;
    if (soft(scan_hu.values[v]) && soft(scan_hu.values[v + 1]))
      changes.push_back(std::abs(scan_hu.values[v + 1] - scan_hu.values[v]));
  }
  if (changes.size() < kEnough) return kUsual;
  const auto middle = changes.begin() + changes.size() / 2;
  std::nth_element(changes.begin(), middle, changes.end());
  return std::clamp(*middle / 0.954, kLeast, kMost);  // the median of |a - b| of two normal deviates
}

double DiagonalMm(const VoxelBox& box, const Grid& grid) {
  return box.size().cast<double>().cwiseProduct(grid.spacing_mm).norm();
}

VoxelBox WithMargin(const VoxelBox& box, const Grid& grid) {
  const double margin_mm = std::max(kMarginMm, kMarginOfDiagonal * DiagonalMm(box, grid));
  return box.Grown((margin_mm * grid.spacing_mm.cwiseInverse()).array().ceil().cast<int>().matrix(), grid);
}

// Where the box ends and the scan goes on.
bool OnInnerSide(const Eigen::Vector3i& p, const VoxelBox& box, const Grid& scan) {
  const Eigen::Vector3i size = box.size();
  for (int axis = 0; axis < 3; ++axis) {
    if (p[axis] == 0 && box.low[axis] > 0) return true;
    if (p[axis] + 1 == size[axis] && box.high[axis] < scan.size[axis]) return true;
  }
  return false;
}

class CtBone {
 public:
  CtBone(const Volume& scan_hu, const LabelMap& strokes, const Mask& outside, const StrokeBox& bone,
         const VoxelBox& box, double noise_hu)
      : bone_(bone),
        box_(box),
        scan_grid_(scan_hu.grid),
        diagonal_mm_(DiagonalMm(bone.box, scan_hu.grid)),
        noise_hu_(noise_hu),
        hu_(Cropped(scan_hu, box)),
        marks_(Cropped(strokes, box)),
        outside_(Cropped(outside, box)),
        density_(hu_) {
    for (float& d : density_.values) d = std::clamp(d, kLowHu, kHighHu) / kUnitHu;
    for (size_t v = 0; v < marks_.values.size(); ++v) {
      if (marks_.values[v] != 0) outside_.values[v] = marks_.values[v] == kBackgroundStroke;
    }
  }

  FoundBone Find() const {
    FoundBone found{bone_.label, box_, {}, Lean(), false};
    found.mask = Cut(found.lean);
    for (size_t v = 0; v < found.mask.values.size(); ++v) {
      if (Own(v)) found.lean.values[v] = INFINITY;
      found.reaches_box |= found.mask.values[v] && OnInnerSide(hu_.grid.Ijk(v), box_, scan_grid_);
    }
    return found;
  }

 private:
  bool Own(size_t v) const { return marks_.values[v] == bone_.label; }
  bool OtherBone(size_t v) const {
    return marks_.values[v] != 0 && marks_.values[v] != kBackgroundStroke && !Own(v);
  }

  template <class Is>
  Image<float> WaysFrom(Is&& is, GeodesicOptions::Paid paid, double most_mm) const {
    std::vector<GeodesicSource> from;
    for (size_t v = 0; v < marks_.values.size(); ++v) {
      if (is(v)) from.push_back({v, 0});
    }
    return GeodesicDistance(density_, from,
                            {.mm_per_contrast = kDiagonalsPerUnit * diagonal_mm_,
                             .noise = noise_hu_ / kUnitHu,
                             .most_mm = most_mm,
                             .paid = paid});
  }

  // 1: bone for sure, -1: not. No way within a bone costs more than a diagonal of its strokes, whatever the
  // others' ways.
  Image<float> Lean() const {
    const double most_mm = diagonal_mm_;
    const Image<float> own = WaysFrom([&](size_t v) { return Own(v); }, GeodesicOptions::kFalls, 3 * most_mm);
    const Image<float> others =
        WaysFrom([&](size_t v) { return OtherBone(v); }, GeodesicOptions::kFalls, most_mm);
    const Image<float> outside = WaysFrom([&](size_t v) { return outside_.values[v] != 0; },
                                          GeodesicOptions::kRises, most_mm / kOutsideHandicap);
    Mask strokes(hu_.grid);
    for (size_t v = 0; v < strokes.values.size(); ++v) strokes.values[v] = Own(v);
    Image<float> lean = RemotenessFromLines(strokes);
    for (size_t v = 0; v < lean.values.size(); ++v) {
      const float other = std::min({others.values[v], kOutsideHandicap * outside.values[v], float(most_mm)});
      const float near = std::isfinite(own.values[v])
                             ? 2 * (other - own.values[v]) / std::max(other + own.values[v], 1e-6f)
                             : -1.0f;
      lean.values[v] =
          std::clamp(near, -1.0f, 1.0f) - kRemoteLean * std::clamp(1.2f * (lean.values[v] - 1), 0.0f, 1.0f);
    }
    return lean;
  }

  Mask Cut(const Image<float>& lean) const {
    Image<float> cost(hu_.grid);
    Image<Side> sides(hu_.grid, Side::kFree);
    for (size_t v = 0; v < cost.values.size(); ++v) {
      const double looks = std::clamp(double(hu_.values[v] - kBoneHu) / kBoneScaleHu, -kSoftNats, kBoneNats);
      cost.values[v] = float(-looks - kLeanNats * lean.values[v]);
      if (outside_.values[v] || OtherBone(v)) sides.values[v] = Side::kOutside;
      if (Own(v)) sides.values[v] = Side::kInside;
    }
    return MinimumCut(cost, sides, density_,
                      {.strength = kLinkNats,
                       .contrast = std::max(kLeastEdgeHu, 2 * noise_hu_) / kUnitHu,
                       .falls_outwards = 1});
  }

  const StrokeBox& bone_;
  const VoxelBox box_;
  const Grid& scan_grid_;
  const double diagonal_mm_, noise_hu_;
  const Volume hu_;
  const LabelMap marks_;
  Mask outside_;    // by strokes, or by itself where no stroke says otherwise
  Volume density_;  // in units
};

}  // namespace

std::vector<FoundBone> FindCtBones(const Volume& scan_hu, const LabelMap& strokes,
                                   const std::vector<StrokeBox>& boxes, const Progress& progress) {
  const Mask outside = OutsideOfBones(scan_hu);
  const double noise_hu = NoiseHu(scan_hu);
  progress.Report("segment", 0.3);
  std::vector<FoundBone> found(boxes.size());
  ParallelFor(boxes.size(), [&](size_t b) {
    VoxelBox box = boxes[b].box;
    for (int growth = 0; growth == 0 || (growth <= kMostGrowth && found[b].reaches_box); ++growth) {
      box = WithMargin(box, scan_hu.grid);
      found[b] = CtBone(scan_hu, strokes, outside, boxes[b], box, noise_hu).Find();
    }
  });
  progress.Report("segment", 1.0);
  return found;
}

}  // namespace kvx
