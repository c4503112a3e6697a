// A voxel is likelier a bone's whose strokes are near, by ways that pay for falls of density and in measure
// of how far that bone's strokes lie apart. Far from all strokes voxels say little of their own, for their
// neighbours say the same. Seams are cheap along the narrow valleys that joints are, and dear through cortex,
// which joints do not cross. In a large scan seams are looked for on blocks of voxels.
#include "pipeline/segmentation/ct/part_bones.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "core/host/parallel.h"
#include "core/numbers/quantile.h"
#include "core/voxels/grid_lines.h"
#include "core/voxels/to_corner.h"
#include "core/voxels/voxel_box.h"
#include "pipeline/scans/coarser.h"
#include "pipeline/segmentation/ct/ct_border.h"
#include "pipeline/segmentation/cuts/label_cut.h"
#include "pipeline/segmentation/strokes/geodesic.h"

namespace kvx {
namespace {

constexpr double kDiagonalsPerUnit = 1;             // what a fall by one unit of density costs
constexpr double kSeamNats = 8;                     // per face of a voxel
constexpr double kValleyHu = 20;                    // depth of a valley that makes a seam e times as cheap
constexpr double kFar = 1;                          // root of mm: there a voxel's say is half
constexpr double kNotCortex = 0.75;                 // of what was found, the least dense part
constexpr double kCortexPower = 3, kMostTimes = 3;  // of its density, in times of where it begins
constexpr int kNoLabel = -1;
constexpr float kLeastShare = 1e-4f;
constexpr float kLeastHu = -100, kMostHu = 800;

// The best of a voxel and its six neighbours.
template <class Better>
Volume Extreme(const Volume& in, Better better) {
  Volume out = in;
  ForEachPair(in.grid, [&](size_t v, size_t next) {
    if (better(in.values[next], out.values[v])) out.values[v] = in.values[next];
    if (better(in.values[v], out.values[next])) out.values[next] = in.values[v];
  });
  return out;
}

// How much denser it gets on both sides of a voxel that lies in a valley one or two voxels wide.
Volume ValleysHu(Volume hu) {
  for (float& v : hu.values) v = std::clamp(v, kLeastHu, kMostHu);
  Volume depth = Extreme(Extreme(hu, std::greater<>()), std::less<>());
  for (size_t v = 0; v < hu.values.size(); ++v) depth.values[v] -= hu.values[v];
  return depth;
}

// Where cortex begins.
double CortexHu(const Volume& hu, const std::vector<size_t>& found) {
  std::vector<float> densities;
  for (const size_t v : found) densities.push_back(std::clamp(hu.values[v], 1.0f, kMostHu));
  return TakeQuantile(densities, kNotCortex);
}

// Where noise hides how deep valleys are, seams tell less.
double SureValleyHu(double noise_hu) { return std::max(kValleyHu, noise_hu); }

// Of what was found.
Image<float> SeamRoots(const Volume& hu, const std::vector<size_t>& found, double noise_hu) {
  const double valley_hu = SureValleyHu(noise_hu), cortex_hu = CortexHu(hu, found);
  Image<float> roots = ValleysHu(hu);
  for (const size_t v : found) {
    const double times = std::clamp(std::min(hu.values[v], kMostHu) / cortex_hu, 1.0, kMostTimes);
    const double nats = kSeamNats * std::pow(times, kCortexPower);
    roots.values[v] = float(std::sqrt(nats) * std::exp(-roots.values[v] / (2 * valley_hu)));
  }
  return roots;
}

class Parting {
 public:
  // All on the same grid. Strokes of the bones that were found only.
  Parting(const Volume& hu, const LabelMap& strokes, const LabelMap& found)
      : hu_(hu),
        strokes_(strokes),
        noise_hu_(NoiseHu(hu)),
        density_(DensityOf(hu)),
        labels_(found),
        slot_(hu.grid) {
    within_ = Mask(hu.grid);
    for (size_t v = 0; v < found.values.size(); ++v) {
      if (found.values[v] == 0) continue;
      within_.values[v] = 1;
      slot_.values[v] = uint32_t(voxels_.size());
      voxels_.push_back(v);
      if (strokes.values[v] != 0) sources_[strokes.values[v]].push_back({v, 0});
    }
  }

  LabelMap Run() {
    FindNats();
    for (size_t n = 0; n < voxels_.size(); ++n) labels_.values[voxels_[n]] = Likeliest(n);
    const auto nats = [&](uint16_t label, size_t v) {
      const auto of_label = nats_.find(label);
      return of_label == nats_.end() ? kNever : of_label->second[slot_.values[v]];
    };
    return CheapestLabels(std::move(labels_), {nats, SeamRoots(hu_, voxels_, noise_hu_)});
  }

 private:
  static constexpr float kNever = std::numeric_limits<float>::infinity();

  // In roots of millimetres.
  std::vector<float> DistancesOf(uint16_t label) const {
    VoxelBox box;
    for (const GeodesicSource& source : sources_.at(label)) box.Include(within_.grid.Ijk(source.voxel));
    const double diagonal_mm = DiagonalMm(box, within_.grid);
    const Image<float> ways_mm = GeodesicDistance(density_, sources_.at(label),
                                                  {.mm_per_contrast = kDiagonalsPerUnit * diagonal_mm,
                                                   .noise = noise_hu_ / kDensityUnitHu,
                                                   .paid = GeodesicOptions::kFalls,
                                                   .within = &within_});
    std::vector<float> distances(voxels_.size());
    for (size_t n = 0; n < voxels_.size(); ++n)
      distances[n] = ways_mm.values[voxels_[n]] / float(std::sqrt(diagonal_mm));
    return distances;
  }

  void FindNats() {
    std::vector<uint16_t> labels;
    for (const auto& [label, sources] : sources_) labels.push_back(label), nats_[label] = {};
    ParallelFor(labels.size(), [&](size_t n) { nats_.at(labels[n]) = DistancesOf(labels[n]); });
    for (size_t n = 0; n < voxels_.size(); ++n) {
      const uint16_t stroke = strokes_.values[voxels_[n]];
      double sum = 0;
      float nearest = kNever;
      for (const auto& [label, distances] : nats_)
        sum += Nearness(distances[n]), nearest = std::min(nearest, distances[n]);
      const float say = Say(nearest);
      for (auto& [label, nats] : nats_) {
        const bool never = !std::isfinite(nats[n]) || (stroke != label && sources_.contains(stroke));
        nats[n] = never ? kNever : -say * std::log(float(Nearness(nats[n]) / sum) + kLeastShare);
      }
    }
  }
  // Of a voxel, by its distance from the nearest strokes; farther out in noise, which hides valleys.
  float Say(float nearest) const {
    const double parts = nearest / (kFar * SureValleyHu(noise_hu_) / kValleyHu);
    return float(1 / (1 + parts * parts));
  }
  static double Nearness(float distance) {
    const double d = std::max(distance, 1e-3f);
    return 1 / (d * d);
  }

  // What no stroke gets to stays as it is.
  uint16_t Likeliest(size_t n) const {
    uint16_t likeliest = labels_.values[voxels_[n]];
    float least = kNever;
    for (const auto& [label, nats] : nats_) {
      if (nats[n] >= least) continue;
      least = nats[n];
      likeliest = label;
    }
    return likeliest;
  }

  const Volume& hu_;
  const LabelMap& strokes_;
  const double noise_hu_;
  const Volume density_;
  LabelMap labels_;
  Mask within_;
  Image<uint32_t> slot_;        // of a voxel that belongs to a bone, in:
  std::vector<size_t> voxels_;  // those voxels
  std::map<uint16_t, std::vector<GeodesicSource>> sources_;
  std::map<uint16_t, std::vector<float>> nats_;  // by label and slot
};

// The label that most of the blocks around the voxel's place have.
uint16_t LabelAt(const LabelMap& blocks, const Eigen::Vector3d& place, uint16_t otherwise) {
  const Eigen::Vector3d p = blocks.grid.Nearest(PointVox{place}).ijk;
  const Eigen::Vector3i low = p.array().floor().cast<int>().min(blocks.grid.size.array() - 2).max(0).matrix();
  std::map<uint16_t, double> weights;
  for (int n = 0; n < 8; ++n) {
    const Eigen::Vector3i corner = (low + ToCorner(n)).cwiseMin((blocks.grid.size.array() - 1).matrix());
    const double weight = (1 - (p - corner.cast<double>()).array().abs()).max(0).prod();
    if (const uint16_t label = blocks(corner.x(), corner.y(), corner.z())) weights[label] += weight;
  }
  double most = 0;
  for (const auto& [label, weight] : weights) {
    if (weight > most) most = weight, otherwise = label;
  }
  return otherwise;
}

}  // namespace

LabelMap PartedBones(const Volume& scan_hu, const LabelMap& strokes, LabelMap found, size_t most_voxels) {
  VoxelBox box;
  std::set<uint16_t> bones;
  for (size_t v = 0; v < found.values.size(); ++v) {
    if (found.values[v] == 0) continue;
    box.Include(found.grid.Ijk(v));
    bones.insert(found.values[v]);
  }
  if (box.empty()) return found;
  const BlockedBox part{box, BlocksFor(box, scan_hu.grid, most_voxels).back()};
  const Volume hu = Coarser(scan_hu, part);
  LabelMap marks = Coarser(strokes, part, kNoLabel);
  for (uint16_t& mark : marks.values) mark = bones.contains(mark) ? mark : 0;
  const LabelMap blocks = Parting(hu, marks, Coarser(found, part, kNoLabel)).Run();
  const Eigen::Array3d edges = part.block.cast<double>();
  ForEachVoxel(box, found.grid, [&](const Eigen::Vector3i& p, size_t, size_t v) {
    uint16_t& label = found.values[v];
    if (label == 0 || strokes.values[v] == label) return;
    label = LabelAt(blocks, (p.cast<double>().array() - (edges - 1) / 2) / edges, label);
  });
  return found;
}

}  // namespace kvx
