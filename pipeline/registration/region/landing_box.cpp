// A box of every few voxels' places.
#include "pipeline/registration/region/landing_box.h"

#include <algorithm>

#include "pipeline/registration/region/blend_table.h"

namespace kvx {
namespace {

constexpr int kEvery = 2;  // voxels, along every axis

}  // namespace

VoxelBox LandingBox(const RegistrationInputs& inputs, const Grid& grid) {
  const PoseVector pose = PoseOf(*inputs.fits);
  const BlendTable blend(pose);
  const Mask& body = *inputs.body;
  VoxelBox box{grid.size, Eigen::Vector3i::Zero()};
  ForEachVoxel(BoxOf(body), [&](const Eigen::Vector3i& p) {
    if (p.x() % kEvery || p.y() % kEvery || p.z() % kEvery || !body(p.x(), p.y(), p.z())) return;
    const size_t v = body.grid.Index(p.x(), p.y(), p.z());
    const PointMm at{Apply(blend(inputs.weights->values[v]), body.grid.ToMm(p.x(), p.y(), p.z()).lps)};
    const Eigen::Array3d in_grid =
        grid.ToVox(at).ijk.array().max(0).min(grid.size.cast<double>().array() - 1);
    box.low = box.low.cwiseMin(in_grid.floor().cast<int>().matrix());
    box.high = box.high.cwiseMax(in_grid.ceil().cast<int>().matrix() + Eigen::Vector3i::Ones());
  });
  if (box.empty()) return {Eigen::Vector3i::Zero(), grid.size};
  return GrownByMm(box, kLandingSpareMm, grid);
}

}  // namespace kvx
