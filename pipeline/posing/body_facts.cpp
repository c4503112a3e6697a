// Over all stored nodes.
#include "pipeline/posing/body_facts.h"

#include "core/numbers/quantile.h"
#include "core/numbers/value_range.h"
#include "core/voxels/to_corner.h"

namespace kvx {
namespace {

bool IsCarried(const BrickedBody& body, const Eigen::Vector3i& node) {
  const int brick = body.BrickOf(node);
  return brick >= 0 && brick < body.cell_bricks &&
         body.IsCarried(brick, BrickedBody::Offset(BrickedBody::Slot(node)));
}

}  // namespace

float AirOf(const Volume& volume, const BrickedBody& body) {
  std::vector<float> outside;
  for (size_t v = 0; v < volume.values.size(); v += 7) {
    if (!IsCarried(body, volume.grid.Ijk(v))) outside.push_back(volume.values[v]);
  }
  if (outside.empty()) return PlausibleRangeOf(volume.values).least;
  return TakeMedian(outside);
}

VoxelExtent BodyBox(const BrickedBody& body) {
  VoxelExtent box;
  for (int brick = 0; brick < body.stored(); ++brick) {
    for (int n = 0; n < BrickedBody::kNodes; ++n) {
      if (!((body.body[brick] >> n) & 1)) continue;
      const Eigen::Vector3d node = (body.FirstNode(brick) + BrickedBody::Offset(n)).cast<double>();
      box.lo = box.lo.cwiseMin(node), box.hi = box.hi.cwiseMax(node);
    }
  }
  return box;
}

int64_t ClosedCells(const BrickedBody& body) {
  int64_t count = 0;
  for (int brick = 0; brick < body.cell_bricks; ++brick) {
    for (int n = 0; n < BrickedBody::kNodes; ++n) {
      bool closed = true;
      for (int corner = 0; closed && corner < 8; ++corner) {
        const Eigen::Vector3i offset = ToCorner(corner);
        closed = body.IsBody(brick, BrickedBody::Offset(n) + offset);
      }
      count += closed;
    }
  }
  return count;
}

}  // namespace kvx
