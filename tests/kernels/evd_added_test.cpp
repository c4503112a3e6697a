// What a pose adds to its examples' displacements: on its lattice, at the nodes of a bent bar, and in the
// pose.
#include "kernels/evd_added.h"

#include <gtest/gtest.h>

#include "kernels/evd_reach.h"
#include "kernels/reference/evd.h"
#include "pipeline/posing/brick_body.h"
#include "tests/support/fixtures.h"
#include "tests/support/hinge_world.h"

namespace kvx {
namespace {
using namespace testing_support;
using Eigen::Vector3d, Eigen::Vector3f, Eigen::Vector3i;

// A linear function of the template voxel, from outside of the template on, ending within it.
struct Linear {
  Eigen::Matrix3d slope = (Eigen::Matrix3d() << 0.05, 0.01, 0, -0.02, 0.03, 0.01, 0, 0.02, -0.04).finished();
  Vector3d shift{0.4, -0.3, 0.6};

  Vector3d At(const Vector3d& voxel) const { return slope * voxel + shift; }
  AddedDisplacement OnLattice() const {
    AddedDisplacement out{Vector3i(-4, -3, -6), Vector3i(4, 3, 5), Vector3i(7, 11, 9), {}};
    for (int n = 0; n < out.size.prod(); ++n) {
      const Vector3i node(n % out.size.x(), n / out.size.x() % out.size.y(), n / out.size.x() / out.size.y());
      out.voxels.push_back(At((out.first + out.step.cwiseProduct(node)).cast<double>()).cast<float>());
    }
    return out;
  }
};

TEST(AddedDisplacement, IsLinearBetweenItsNodesAndStaysAsItIsBeyondThem) {
  const Linear linear;
  const AddedDisplacement added = linear.OnLattice();
  for (const Vector3i& inside :
       {Vector3i(0, 0, 0), Vector3i(3, 7, 11), Vector3i(20, 27, 34), Vector3i(-4, -3, -6)})
    EXPECT_LT((added.At(inside) - linear.At(inside.cast<double>())).norm(), 1e-5) << inside.transpose();
  EXPECT_LT((added.At({50, 5, 60}) - linear.At({20, 5, 34})).norm(), 1e-5);
  EXPECT_LT((added.At({-9, 40, 5}) - linear.At({-4, 27, 5})).norm(), 1e-5);
}

struct Bar {
  HingeWorld world;
  DisplacementField bulge = world.Bulge(1.5);
  BrickedBody bricked = BrickBody(world.Inputs({&bulge}));
  AddedDisplacement lattice = Linear().OnLattice();
  std::vector<Vector3d> twin = reference::EvdAdded(bricked, lattice, world.bones.labels);
  PoseVector pose = world.Bent(0.8);
  Eigen::MatrixXf coefficients = Eigen::MatrixXf::Constant(2, 1, 0.7f);
  DeviceBody device{SharedBackend(), bricked};
  BufferCounts counts;
  AddedNodes nodes{SharedBackend(), counts};
  ReachingBricks reaching{SharedBackend(), counts};

  Bar() {
    const DeviceBuffer<uint16_t> labels(SharedBackend(),
                                        std::span<const uint16_t>(world.bones.labels.values));
    EvdAdded{SharedBackend()}(SharedBackend().queue(), device, lattice, labels, world.body.grid.size, nodes);
  }
};

TEST(EvdAdded, IsItsTwinAtTheNodesAndNothingInBones) {
  Bar bar;
  size_t none = 0;
  bar.nodes.voxels.Read(SharedBackend().queue(), 3 * bar.twin.size(), [&](std::span<const float> found) {
    for (size_t n = 0; n < bar.twin.size(); ++n) {
      const float* at = &found[n / 64 * 192 + n % 64];
      ASSERT_LT((Vector3d(at[0], at[64], at[128]) - bar.twin[n]).norm(), 1e-4) << n;
      none += bar.twin[n].isZero();
    }
  });
  EXPECT_GT(none, 50u) << "the bar has bones";
  EXPECT_LT(none, bar.twin.size() / 2);
}

TEST(EvdAdded, SaysOfEveryBrickTheLeastAndTheMost) {
  Bar bar;
  bar.nodes.ranges.Read(
      SharedBackend().queue(), 6 * size_t(bar.bricked.stored()), [&](std::span<const float> found) {
        for (size_t brick = 0; brick < size_t(bar.bricked.stored()); ++brick) {
          for (int a = 0; a < 3; ++a) {
            const auto [least, most] =
                std::minmax_element(&bar.twin[64 * brick], &bar.twin[64 * brick] + 64,
                                    [&](const Vector3d& u, const Vector3d& v) { return u[a] < v[a]; });
            ASSERT_NEAR(found[6 * brick + size_t(a)], (*least)[a], 1e-4);
            ASSERT_NEAR(found[6 * brick + 3 + size_t(a)], (*most)[a], 1e-4);
          }
        }
      });
}

TEST(EvdForward, WithWhatIsAddedIsItsTwin) {
  Bar bar;
  const Grid& grid = bar.world.body.grid;
  const reference::Places truth =
      reference::EvdForward(bar.bricked, grid, grid, bar.pose, bar.coefficients, bar.twin);
  std::vector<int32_t> every;
  for (int brick = 0; brick < bar.bricked.stored(); ++brick) every.push_back(brick);
  const DeviceBuffer<int32_t> list(SharedBackend(), std::span<const int32_t>(every));
  PosedNodes posed(SharedBackend(), bar.counts);
  EvdForward{SharedBackend()}(SharedBackend().queue(), bar.device, list.buffer(), bar.device.stored,
                              ForwardPose(grid, grid, bar.pose, bar.coefficients), posed, &bar.nodes);
  posed.places.Read(SharedBackend().queue(), 3 * truth.size(), [&](std::span<const float> found) {
    for (size_t n = 0; n < truth.size(); ++n) {
      const float* at = &found[n / 64 * 192 + n % 64];
      ASSERT_LT((Vector3d(at[0], at[64], at[128]) - truth[n]).norm(), 1e-3) << n;
    }
  });
}

TEST(EvdReach, KnowsWhatIsAdded) {
  Bar bar;
  const Grid& grid = bar.world.body.grid;
  const EvdReach reach(SharedBackend());
  reach.Bound(SharedBackend().queue(), bar.device, ForwardPose(grid, grid, bar.pose, bar.coefficients),
              bar.reaching, &bar.nodes);
  size_t moved_across = 0;
  for (double z = 6.3; z < 36; z += 3) {
    Grid plane = grid;
    plane.size.z() = 1;
    plane.origin = grid.ToMm(PointVox{Vector3d(0, 0, z)});
    reach(SharedBackend().queue(), bar.bricked, bar.device, grid, plane, bar.reaching);
    std::vector<uint8_t> reaches(size_t(bar.bricked.cell_bricks), 0);
    for (const int32_t brick : bar.reaching.host_cells) reaches[size_t(brick)] = 1;
    const auto twin = [&](std::span<const Vector3d> added) {
      return reference::EvdReach(bar.bricked, grid, plane, bar.pose, bar.coefficients,
                                 EvdReach::Margin(grid, plane), EvdReach::CutMargin(grid, plane), added);
    };
    const std::vector<uint8_t> expected = twin(bar.twin), without = twin({});
    size_t unlike = 0;
    for (size_t brick = 0; brick < reaches.size(); ++brick) {
      unlike += reaches[brick] != expected[brick];
      moved_across += expected[brick] != without[brick];
    }
    EXPECT_LE(unlike, 1u) << z;
  }
  EXPECT_GT(moved_across, 3u);
}

}  // namespace
}  // namespace kvx
