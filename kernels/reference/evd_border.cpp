// Voxel by voxel, from the nodes' weights themselves.
#include <algorithm>
#include <array>

#include "core/bone_of_label.h"
#include "core/voxels/to_corner.h"
#include "kernels/reference/evd.h"

namespace kvx::reference {
namespace {

using Eigen::Vector3d, Eigen::Vector3i;

int BoneOf(const BrickedBody& body, const Vector3i& node, int brick) {
  if (!body.IsBone(brick, node - body.FirstNode(brick))) return kNoBone;
  const VoxelWeights w = body.NodeWeights(body.BrickOf(node), BrickedBody::Slot(node));
  return w.weights[0] == 1 ? w.bones[0] : kNoBone;
}

// The nodes around a place: their trilinear weights and bones.
struct Corners {
  std::array<double, 8> parts{};
  std::array<int, 8> bones = {kNoBone, kNoBone, kNoBone, kNoBone, kNoBone, kNoBone, kNoBone, kNoBone};
  double Share(int bone) const {
    double sum = 0;
    for (int n = 0; n < 8; ++n) sum += bones[n] == bone ? parts[n] : 0;
    return sum;
  }
  bool Mixed() const {
    return std::ranges::any_of(bones, [&](int bone) { return bone != bones[0]; });
  }
};

Corners CornersAt(const BrickedBody& body, const Vector3d& place) {
  const Vector3i last = BrickedBody::kEdge * body.bricks - Vector3i::Ones();
  const Vector3d inside = place.cwiseMax(0.0).cwiseMin(last.cast<double>());
  const Vector3i low = inside.cast<int>().cwiseMin(last - Vector3i::Ones());
  const int brick = body.BrickOf(low);
  Corners corners;
  if (brick < 0 || brick >= body.cell_bricks) return corners;
  const Vector3d f = inside - low.cast<double>();
  for (int n = 0; n < 8; ++n) {
    const Vector3i d = ToCorner(n);
    corners.bones[n] = BoneOf(body, low + d, brick);
    corners.parts[n] = 1;
    for (int a = 0; a < 3; ++a) corners.parts[n] *= d[a] ? f[a] : 1 - f[a];
  }
  return corners;
}

void Settle(const BrickedBody& body, const std::vector<AffineMap>& backs, const Corners& corners,
            const Vector3d& voxel, Landing& landing) {
  double share = 0, own_share = -1;
  Vector3d own = landing.place;
  for (int bone = int(backs.size()); bone-- > 0;) {
    if (!std::ranges::count(corners.bones, bone)) continue;
    const Vector3d at = Apply(backs[size_t(bone)], voxel);
    const double there = (at.array() > -0.5).all() ? CornersAt(body, at).Share(bone) : 0;
    if (there > own_share) share = corners.Share(bone), own_share = there, own = at;
  }
  if (own_share >= 0.5) {
    landing = {own, kBone};
    return;
  }
  const Vector3d way = own - landing.place;
  const double out = own_share > 0 ? 1 - own_share : std::max(1.0, 1 - share + way.norm());
  landing.place += share / (2 * out - 1 + share) * way;
  landing.claim = landing.claim == kBone ? kInnerBody : landing.claim;
}

}  // namespace

void SettleBorders(const BrickedBody& body, const PoseVector& pose, const Grid& from, const Grid& to,
                   std::vector<Landing>& landings) {
  std::vector<AffineMap> backs;
  for (const RigidTransform& posed_from_template : pose) {
    const RigidTransform back = posed_from_template.Inverse();
    AffineMap map;
    map.leftCols<3>() = from.VoxFromMm() * back.rotation.toRotationMatrix() * to.MmFromVox();
    map.col(3) = from.ToVox(back * to.origin).ijk;
    backs.push_back(map);
  }
  for (size_t v = 0; v < landings.size(); ++v) {
    if (landings[v].claim == kUnclaimed) continue;
    const Corners corners = CornersAt(body, landings[v].place);
    if (corners.Mixed()) Settle(body, backs, corners, to.Ijk(v).cast<double>(), landings[v]);
  }
}

}  // namespace kvx::reference
