// The posing kernels against their plain-loop twins, on a small body of two bones with discontinuous weights.
#include <gtest/gtest.h>

#include <cmath>

#include "kernels/evd_forward.h"
#include "kernels/evd_inverse_sample.h"
#include "kernels/rasterise_tetrahedra.h"
#include "kernels/reference/evd.h"
#include "pipeline/posing/brick_body.h"
#include "tests/support/fixtures.h"
#include "tests/support/hinge_world.h"

namespace kvx {
namespace {
using namespace testing_support;

struct Posing {
  explicit Posing(double angle_rad, bool torn = false) : pose(world.Bent(angle_rad)), to(world.body.grid) {
    if (torn) {  // a jump of the weights across a cut through half of the bar
      for (size_t v = 0; v < world.weights.values.size(); ++v) {
        const Eigen::Vector3i n = world.body.grid.Ijk(v);
        if (n.y() > 15) world.weights.values[v] = {{uint8_t(n.z() > 24), 0, 0, 0}, {1, 0, 0, 0}};
      }
    }
    bulge = world.Bulge(1.5);
    bricked = BrickBody(world.Inputs({&bulge}));
    coefficients = Eigen::MatrixXf::Constant(2, 1, 0.7f);
    to.spacing_mm *= 1.1;
    to.direction = Eigen::AngleAxisd(0.2, Eigen::Vector3d(1, 1, 0.3).normalized()) * to.direction;
    truth = reference::EvdForward(bricked, world.body.grid, to, pose, coefficients);
  }
  double Ratio() const { return to.MmFromVox().determinant() / world.body.grid.MmFromVox().determinant(); }
  // The twin's places on the device: both sides of a comparison then start from the same numbers (rounded to
  // float).
  PosedNodes Upload() {
    std::vector<cl_float4> nodes;
    for (Eigen::Vector3d& p : truth) {
      p = p.cast<float>().cast<double>();
      nodes.push_back({{float(p.x()), float(p.y()), float(p.z()), 0}});
    }
    return PosedNodes(SharedBackend(), nodes);
  }
  HingeWorld world;
  PoseVector pose;
  Grid to;
  DisplacementField bulge;
  BrickedBody bricked;
  Eigen::MatrixXf coefficients;
  reference::Places truth;
};

TEST(EvdForward, EqualsItsTwin) {
  Backend& backend = SharedBackend();
  for (const double angle : {0.4, 2.6}) {  // the second needs the dual-quaternion guard
    Posing p(angle);
    const DeviceBody device(backend, p.bricked);
    PosedNodes posed(backend, p.truth.size());
    EvdForward{backend}(
        backend.queue(), device,
        ForwardPose(p.world.body.grid, p.to, p.pose, p.coefficients, p.bricked.example_scales), posed);
    const std::vector<cl_float4> found = posed.Download(backend.queue());
    size_t apart = 0;
    for (size_t v = 0; v < found.size(); ++v) {
      apart += !((Eigen::Vector3d(found[v].s[0], found[v].s[1], found[v].s[2]) - p.truth[v]).norm() < 2e-3);
    }
    EXPECT_LE(apart, found.size() / 1000)
        << "at " << angle << " rad";  // nodes at the guard's very threshold may differ
  }
}

void ExpectSameOwnersAndVolumes(double angle_rad, bool torn) {
  Backend& backend = SharedBackend();
  Posing p(angle_rad, torn);
  const DeviceBody device(backend, p.bricked);
  const PosedNodes posed = p.Upload();
  RasteriseTetrahedra rasterise(backend);
  PosedBricks bricks(backend, device);
  rasterise.Classify(backend.queue(), device, posed, float(p.Ratio()), bricks);
  const std::vector<uint8_t> smooth = bricks.smooth.Download(backend.queue());
  const std::vector<uint8_t> smooth_twin = reference::SmoothBricks(p.bricked, p.truth, p.Ratio());
  size_t unlike = 0, coarse = 0;
  for (size_t b = 0; b < smooth_twin.size(); ++b) unlike += smooth[b] != smooth_twin[b], coarse += smooth[b];
  EXPECT_LE(unlike, smooth_twin.size() / 200);
  EXPECT_GT(coarse, 0u);
  EXPECT_LT(coarse, smooth_twin.size());  // both kinds of cell are met

  OwnerVolume owner(backend, p.to.VoxelCount());
  rasterise(backend.queue(), device, posed, bricks, p.world.body.grid, p.to, owner);
  const std::vector<uint32_t> owners = owner.Download(backend.queue());
  const std::vector<uint32_t> owners_twin =
      reference::RasteriseTetrahedra(p.bricked, p.truth, smooth, p.world.body.grid, p.to);
  size_t owned = 0, other = 0;
  for (size_t v = 0; v < owners.size(); ++v)
    owned += owners_twin[v] != 0xFFFFFFFFu, other += owners[v] != owners_twin[v];
  EXPECT_GT(owned, 3000u);
  EXPECT_LE(other, owned / 200);  // places on a face, decided by rounding

  const DeviceBuffer<float> image(backend, std::span(p.world.scan.volume.values));
  DeviceBuffer<float> out(backend, owners.size());
  EvdInverseSample(backend).Intensities(backend.queue(), device, posed, owner, p.to, image, p.world.body.grid,
                                        -50, out);
  const std::vector<float> found = out.Download(backend.queue());
  const Volume twin = reference::EvdInverseSample(p.bricked, p.truth, owners, p.to, p.world.scan.volume, -50);
  size_t wrong = 0;
  for (size_t v = 0; v < found.size(); ++v) wrong += !(std::abs(found[v] - twin.values[v]) < 0.1);
  EXPECT_LE(wrong, owned / 200);
}

TEST(RasteriseTetrahedra, EqualsItsTwinOnASmoothBend) { ExpectSameOwnersAndVolumes(0.8, false); }
TEST(RasteriseTetrahedra, EqualsItsTwinWhereWeightsJump) { ExpectSameOwnersAndVolumes(0.5, true); }
TEST(RasteriseTetrahedra, EqualsItsTwinWhereTheBodyFolds) { ExpectSameOwnersAndVolumes(2.4, false); }

}  // namespace
}  // namespace kvx
