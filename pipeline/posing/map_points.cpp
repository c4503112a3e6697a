// The oracle of the posing kernels, and the door for landmarks.
#include "pipeline/posing/map_points.h"

#include <algorithm>
#include <deque>

#include "core/blend.h"
#include "core/bone_border.h"
#include "core/voxels/neighbours.h"
#include "core/voxels/to_corner.h"

namespace kvx {
namespace {

// Breadth first from the bricks with cells: near enough for points in air.
std::vector<int32_t> NearestBricks(const BrickedBody& body) {
  std::vector<int32_t> nearest(body.brick_at.size(), -1);
  std::deque<size_t> front;
  for (size_t i = 0; i < nearest.size(); ++i) {
    if (body.brick_at[i] < 0 || body.brick_at[i] >= body.cell_bricks) continue;
    nearest[i] = body.brick_at[i];
    front.push_back(i);
  }
  const Eigen::Vector3i n = body.bricks;
  for (; !front.empty(); front.pop_front()) {
    const size_t i = front.front();
    for (int side = 0; side < 6; ++side) {
      const Eigen::Vector3i next = body.BrickPlace(i) + StepToSide(side);
      if ((next.array() < 0).any() || (next.array() >= n.array()).any()) continue;
      const size_t at = body.BrickIndex(next);
      int32_t& found = nearest[at];
      if (found >= 0) continue;
      found = nearest[i];
      front.push_back(at);
    }
  }
  return nearest;
}

}  // namespace

PointMapper::PointMapper(const BrickedBody& body, const Grid& template_grid)
    : body_(body), grid_(template_grid), nearest_(NearestBricks(body)) {}

PointMapper::Place PointMapper::NearestStored(const Eigen::Vector3d& voxel) const {
  Eigen::Vector3i brick;
  for (int a = 0; a < 3; ++a) {
    brick[a] = int(std::clamp(std::floor(voxel[a] / BrickedBody::kEdge), 0.0, double(body_.bricks[a] - 2)));
  }
  const int found = nearest_[body_.BrickIndex(brick)];
  const Eigen::Vector3d first = body_.FirstNode(found).cast<double>();
  return {found, voxel.cwiseMax(first).cwiseMin((first.array() + BrickedBody::kEdge).matrix())};
}

std::vector<PointMapper::Corner> PointMapper::CornersAround(const Place& place,
                                                            const AddedDisplacement* added) const {
  std::vector<Corner> corners;
  const Eigen::Vector3d low = place.voxel.array().floor(), above = place.voxel - low;
  for (int n = 0; n < 8; ++n) {
    const Eigen::Vector3i offset = ToCorner(n), node = low.cast<int>() + offset;
    double part = 1;
    for (int a = 0; a < 3; ++a) part *= offset[a] ? above[a] : 1 - above[a];
    if (part == 0) continue;
    const int brick = body_.BrickOf(node), slot = BrickedBody::Slot(node);
    const VoxelWeights weights = body_.NodeWeights(brick, slot);
    const bool labelled = body_.IsBone(place.brick, node - body_.FirstNode(place.brick));
    corners.push_back({part, brick, slot, weights,
                       labelled && weights.weights[1] == 0 ? int(weights.bones[0]) : kNoBone,
                       added && !labelled ? added->At(node) : Eigen::Vector3d::Zero()});
  }
  return corners;
}

PointMm PointMapper::Moved(std::span<const Corner> corners, const ResolvedPose& pose,
                           const PointMm& in_template) const {
  const int examples = std::min(body_.example_count, int(pose.coefficients.cols()));
  AffineMap blended = AffineMap::Zero();
  Eigen::VectorXd coefficients = Eigen::VectorXd::Zero(examples);
  Eigen::Matrix3Xd displacements = Eigen::Matrix3Xd::Zero(3, examples);
  Eigen::Vector3d added = Eigen::Vector3d::Zero();
  double whole = 0;
  for (const Corner& c : corners) whole += c.part;
  for (const Corner& c : corners) {
    const double part = c.part / whole;
    blended += part * Blend(c.weights, pose.scan_from_template);
    added += part * c.added;
    for (int k = 0; k < examples; ++k)
      coefficients[k] += part * CoefficientAt(c.weights, pose.coefficients, k);
    for (uint32_t e = body_.example_first[c.brick]; e < body_.example_first[c.brick + 1]; ++e)
      if (body_.example_refs[e].k < examples)
        displacements.col(body_.example_refs[e].k) += part * body_.NodeExample(e, c.slot);
  }
  const Eigen::Vector3d d_a = grid_.MmFromVox() * (displacements * coefficients + added);
  return {Apply(blended, in_template.lps + d_a)};
}

PointMm PointMapper::operator()(const ResolvedPose& pose, const PointMm& in_template,
                                const AddedDisplacement* added) const {
  if (body_.cell_bricks == 0)
    return pose.scan_from_template.empty() ? in_template : pose.scan_from_template[0] * in_template;
  std::vector<Corner> corners = CornersAround(NearestStored(grid_.ToVox(in_template).ijk), added);
  std::vector<double> parts;
  std::vector<int> bones;
  for (const Corner& c : corners) parts.push_back(c.part), bones.push_back(c.bone);
  const auto [bone, share] = ShareOfBone(parts, bones);
  if (share == 0) return Moved(corners, pose, in_template);
  const auto of_bone =
      std::ranges::stable_partition(corners, [bone = bone](const Corner& c) { return c.bone != bone; });
  const PointMm with_bone = Moved(of_bone, pose, in_template);
  if (share == 1) return with_bone;
  const PointMm beside = Moved({corners.begin(), of_bone.begin()}, pose, in_template);
  return {share * with_bone.lps + (1 - share) * beside.lps};
}

}  // namespace kvx
