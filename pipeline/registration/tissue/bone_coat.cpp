// Surfaces lie half a voxel beyond the centres of a bone's outermost voxels.
#include "pipeline/registration/tissue/bone_coat.h"

#include <algorithm>
#include <map>

#include "core/host/parallel.h"
#include "core/voxels/distance_transform.h"
#include "core/voxels/nearest_voxel.h"

namespace kvx {
namespace {

constexpr double kCoatShare = 0.06;  // of the radius of the largest ball in the bone
constexpr float kFarMm = 1e6f;

// By label.
std::map<uint16_t, double> CoatThicknessesMm(const LabelMap& labels) {
  Mask soft(labels.grid);
  for (size_t v = 0; v < soft.values.size(); ++v) soft.values[v] = labels.values[v] == 0;
  const Volume depth_mm = DistanceMapMm(soft);
  std::map<uint16_t, double> out;
  for (size_t v = 0; v < soft.values.size(); ++v) {
    if (soft.values[v]) continue;
    double& thickness = out[labels.values[v]];
    thickness = std::max(thickness, kCoatShare * depth_mm.values[v]);
  }
  return out;
}

}  // namespace

Volume BeyondBoneCoatMm(const LabelMap& bone_labels, const WorkRegion& region) {
  const LabelMap labels = Crop(bone_labels, region);
  const std::map<uint16_t, double> thickness_mm = CoatThicknessesMm(labels);
  Volume out(region.grid, kFarMm);
  if (thickness_mm.empty()) return out;
  Mask bone(region.grid);
  for (size_t v = 0; v < bone.values.size(); ++v) bone.values[v] = labels.values[v] != 0;
  const std::vector<uint32_t> nearest = NearestMarked(bone);
  const Eigen::Vector3d spacing_mm = region.grid.spacing_mm;
  const double surface_mm = 0.5 * spacing_mm.maxCoeff();
  ParallelEach(nearest.size(), [&](size_t v) {
    const Eigen::Vector3i apart = region.grid.Ijk(v) - region.grid.Ijk(nearest[v]);
    const double mm = apart.cast<double>().cwiseProduct(spacing_mm).norm();
    out.values[v] = float(std::max(0.0, mm - surface_mm) - thickness_mm.at(labels.values[nearest[v]]));
  });
  return out;
}

}  // namespace kvx
