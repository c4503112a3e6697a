// Edges are told by their direction: how bright they are is a matter of the tissue beside the bone.
#include "pipeline/bones/bone_set/border_edges.h"

#include <array>
#include <map>
#include <vector>

#include "core/host/parallel.h"
#include "core/voxels/gaussian_blur.h"
#include "core/voxels/label_surface.h"
#include "core/voxels/voxel_box.h"

namespace kvx {
namespace {

constexpr int kMostShift = 7, kElsewhere = 6;    // voxels along an axis
constexpr double kScanBlur = 0.7, kMapBlur = 1;  // voxels
constexpr size_t kMostPlaces = 20000, kFewestPlaces = 100;
constexpr int kLeastMoved = 2;         // voxels: hand-drawn borders stray by one
constexpr double kMuchBetter = 1.15;   // times the score, here or elsewhere
constexpr int kSeen = kMostShift + 2;  // voxels around the bones that are read

Eigen::Vector3d GradientPerMm(const Volume& volume, const Eigen::Vector3i& at) {
  const auto value = [&](int axis, int step) {
    Eigen::Vector3i p = at;
    p[axis] += step;
    return double(volume(p.x(), p.y(), p.z()));
  };
  Eigen::Vector3d gradient;
  for (int axis = 0; axis < 3; ++axis)
    gradient[axis] = (value(axis, 1) - value(axis, -1)) / (2 * volume.grid.spacing_mm[axis]);
  return gradient;
}

struct Place {
  Eigen::Vector3i voxel;
  Eigen::Vector3d normal;  // unit, out of the bone, along the grid's axes
};

bool Inside(const Grid& grid, const Eigen::Vector3i& voxel, int margin) {
  return (voxel.array() >= margin).all() && (voxel.array() < grid.size.array() - margin).all();
}

std::vector<Place> BorderPlaces(const Mask& bones) {
  const Grid& grid = bones.grid;
  std::vector<Eigen::Vector3i> voxels;
  Volume blurred(grid);
  for (size_t v = 0; v < bones.values.size(); ++v) {
    if (!bones.values[v]) continue;
    blurred.values[v] = 1;
    const Eigen::Vector3i at = grid.Ijk(v);
    if (Inside(grid, at, kMostShift + 1) && AtSurface(bones, at)) voxels.push_back(at);
  }
  GaussianBlur(blurred, Eigen::Vector3d::Constant(kMapBlur));
  std::vector<Place> places;
  for (size_t n = 0; n < voxels.size(); n += voxels.size() / kMostPlaces + 1) {
    const Eigen::Vector3d inward = GradientPerMm(blurred, voxels[n]);
    if (inward.norm() > 0) places.push_back({voxels[n], -inward.normalized()});
  }
  return places;
}

double MeanGradient(const Volume& volume) {
  const Eigen::Vector3i inner = volume.grid.size.array() - 2;
  if (inner.minCoeff() < 1) return 0;
  const double sum =
      ParallelSum<double>(size_t(inner.y()) * size_t(inner.z()), [&](double& so_far, size_t n) {
        const int j = 1 + int(n % size_t(inner.y())), k = 1 + int(n / size_t(inner.y()));
        for (int i = 1; i <= inner.x(); ++i) so_far += GradientPerMm(volume, {i, j, k}).norm();
      });
  return sum / inner.cast<double>().prod();
}

class Scores {
 public:
  Scores(const Volume& scan, std::vector<Place> places)
      : scan_(scan), places_(std::move(places)), faint_(MeanGradient(scan)) {}

  double Of(const Eigen::Vector3i& shift) {
    const auto [found, is_new] = known_.try_emplace(std::array{shift.x(), shift.y(), shift.z()}, 0.0);
    if (is_new) found->second = Measured(shift);
    return found->second;
  }

 private:
  double Measured(const Eigen::Vector3i& shift) const {
    std::vector<double> along(places_.size());
    ParallelEach(places_.size(), [&](size_t n) {
      const Eigen::Vector3d gradient = GradientPerMm(scan_, places_[n].voxel + shift);
      const double normal = gradient.dot(places_[n].normal);
      const double all = gradient.squaredNorm() + faint_ * faint_;
      along[n] = all > 0 ? normal * normal / all : 0;
    });
    double sum = 0;
    for (const double of_place : along) sum += of_place;
    return sum / double(places_.size());
  }

  const Volume& scan_;
  const std::vector<Place> places_;
  const double faint_;  // per mm: of this size a gradient counts half
  std::map<std::array<int, 3>, double> known_;
};

template <class Visit>
void ForEachNeighbour(const Visit& visit) {
  for (int k = -1; k <= 1; ++k) {
    for (int j = -1; j <= 1; ++j) {
      for (int i = -1; i <= 1; ++i) {
        if (i != 0 || j != 0 || k != 0) visit(Eigen::Vector3i(i, j, k));
      }
    }
  }
}

Eigen::Vector3i BestShift(Scores& scores) {
  Eigen::Vector3i at = Eigen::Vector3i::Zero();
  while (true) {
    Eigen::Vector3i best = at;
    ForEachNeighbour([&](const Eigen::Vector3i& step) {
      const Eigen::Vector3i next = at + step;
      if (next.cwiseAbs().maxCoeff() <= kMostShift && scores.Of(next) > scores.Of(best)) best = next;
    });
    if (best == at) return at;
    at = best;
  }
}

Mask BonesOf(const LabelMap& labels) {
  Mask bones(labels.grid);
  for (size_t v = 0; v < labels.values.size(); ++v) bones.values[v] = labels.values[v] != 0;
  return bones;
}

}  // namespace

bool BorderEdges::moved() const {
  constexpr double kRounding = 1e-6;  // of mm; where slices are thick, borders stray by more than a pixel
  return shift.cwiseAbs().maxCoeff() >= kLeastMoved && shift_mm >= (kLeastMoved - kRounding) * voxel_mm &&
         nearby > kMuchBetter * here;
}

bool BorderEdges::follow_nothing() const { return here <= kMuchBetter * elsewhere; }

std::optional<BorderEdges> EdgesOfBorders(const Volume& scan, const LabelMap& labels) {
  const Mask bones = BonesOf(labels);
  const VoxelBox box = BoxOf(bones).Grown(Eigen::Vector3i::Constant(kSeen), scan.grid);
  if (box.empty()) return std::nullopt;
  Volume seen = Cropped(scan, box);
  GaussianBlur(seen, Eigen::Vector3d::Constant(kScanBlur));
  std::vector<Place> places = BorderPlaces(Cropped(bones, box));
  if (places.size() < kFewestPlaces) return std::nullopt;
  Scores scores(seen, std::move(places));
  BorderEdges edges;
  edges.here = scores.Of(Eigen::Vector3i::Zero());
  edges.shift = BestShift(scores);
  edges.nearby = scores.Of(edges.shift);
  edges.shift_mm = edges.shift.cast<double>().cwiseProduct(scan.grid.spacing_mm).norm();
  edges.voxel_mm = scan.grid.MeanSpacingMm();
  ForEachNeighbour(
      [&](const Eigen::Vector3i& step) { edges.elsewhere += scores.Of(kElsewhere * step) / 26; });
  return edges;
}

}  // namespace kvx
