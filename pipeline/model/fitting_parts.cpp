// Sizes, grids, and references to bones and joints.
#include "pipeline/model/fitting_parts.h"

#include <algorithm>

#include "core/host/parallel.h"

namespace kvx {
namespace {

bool IsValid(const Grid& grid) {
  try {
    Validate(grid);
    return true;
  } catch (const InputError&) {
    return false;
  }
}

// Parents come before children.
bool IsTree(const std::vector<Bone>& bones) {
  for (size_t b = 0; b < bones.size(); ++b)
    if (bones[b].label <= 0 || bones[b].parent < kNoParent || bones[b].parent >= int(b)) return false;
  return !bones.empty();
}

bool Fits(const Skeleton& skeleton, size_t bones) {
  if (skeleton.joints.size() != bones) return false;
  for (size_t j = 0; j < bones; ++j) {
    const Joint& joint = skeleton.joints[j];
    const auto is_joint = [&](int driver) { return driver >= 0 && driver < int(bones); };
    if (joint.child != int(j) || joint.parent < kNoParent || joint.parent >= int(j)) return false;
    if (!std::ranges::all_of(joint.drivers, is_joint)) return false;
  }
  return true;
}

// None from versions that did not say it.
bool FitsAxes(const SkeletonFit& fit) {
  return fit.axis_within_rad.empty() || std::ranges::equal(fit.axis_within_rad, fit.skeleton.joints,
                                                           [](const auto& within, const Joint& joint) {
                                                             return within.size() == joint.dofs.size();
                                                           });
}

bool Fits(const SkeletonFit& fit, size_t bones, size_t scans) {
  if (!Fits(fit.skeleton, bones) || !FitsAxes(fit)) return false;
  const auto dofs = size_t(fit.skeleton.DofCount());
  return fit.scan_angles.size() == scans && fit.scan_residuals.size() == scans &&
         fit.scan_roots.size() == scans &&
         std::ranges::all_of(fit.scan_angles, [&](const auto& a) { return size_t(a.size()) == dofs; }) &&
         std::ranges::all_of(fit.scan_residuals, [&](const auto& r) { return r.size() == bones; });
}

bool Fits(const ExampleMoments& moments, Eigen::Index bones, Eigen::Index scans) {
  const bool no_hidden = moments.hidden.size() == 0;
  return (moments.of_bones.empty() || Eigen::Index(moments.of_bones.size()) == bones) &&
         std::ranges::all_of(moments.of_bones,
                             [&](const auto& m) { return m.rows() == scans && m.cols() == scans; }) &&
         (no_hidden || (moments.hidden.rows() == bones && moments.hidden.cols() == scans));
}

}  // namespace

bool GoTogether(const ModelParts& parts) {
  const size_t bones = parts.bones.bones.size(), scans = parts.scan_fits.size();
  return IsValid(parts.grid) && parts.bones.labels.grid == parts.grid && parts.body.grid == parts.grid &&
         IsTree(parts.bones.bones) && Fits(parts.fit, bones, scans) &&
         Fits(parts.moments, Eigen::Index(bones), Eigen::Index(scans)) &&
         std::ranges::all_of(parts.scan_fits, [&](const BoneFits& fits) { return fits.size() == bones; });
}

bool GoWith(const BoneSet& bones, const WeightMap& weights) {
  const size_t count = bones.bones.size();
  const auto known = [&](const VoxelWeights& w) {
    return std::ranges::all_of(w.bones, [&](uint8_t bone) { return bone < count; });
  };
  return weights.grid == bones.labels.grid && std::ranges::all_of(weights.values, known);
}

bool GoWith(const BoneSet& bones, const BrickedBody& bricks, size_t scans) {
  const Grid& grid = bones.labels.grid;
  for (int a = 0; a < 3; ++a) {
    if (BrickedBody::kEdge * (bricks.bricks[a] - 1) < grid.size[a] - 1) return false;
  }
  return size_t(bricks.example_count) == scans &&
         std::ranges::all_of(bricks.palette, [&](uint8_t bone) { return bone < bones.bones.size(); });
}

}  // namespace kvx
