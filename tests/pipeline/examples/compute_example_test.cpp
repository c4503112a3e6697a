// Eq. 7 undoes eq. 6: displacing by d_k and blending lands where the registration says.
#include "pipeline/examples/compute_example.h"

#include <gtest/gtest.h>

#include "core/voxels/distance_transform.h"
#include "pipeline/artifacts/held.h"
#include "tests/support/fixtures.h"
#include "tests/support/hinge_world.h"

namespace kvx {
namespace {
using namespace testing_support;

struct RegisteredHinge {
  explicit RegisteredHinge(double angle_rad) {
    pose = world.Bent(angle_rad);
    const DisplacementField bulge = world.Bulge(2);
    RegisteredScan registered{.scan_from_template =
                                  DisplacementField(world.body.grid, Eigen::Vector3f::Zero())};
    for (size_t v = 0; v < bulge.values.size(); ++v) {
      const Eigen::Vector3d x = PlaceOf(v);
      const Eigen::Vector3d landed =
          Apply(Blend(world.weights.values[v], pose), x + bulge.values[v].cast<double>());
      registered.scan_from_template.values[v] = (landed - x).cast<float>();
    }
    BoneFits fits;
    for (const RigidTransform& t : pose) fits.push_back({.scan_from_template = t});
    StageContext context{SharedBackend(), {}};
    const auto body = Held(world.body);
    const auto weights = Held(world.weights);
    const auto fit = Held(fits);
    const auto scan = Held(registered);
    example = ComputeExample::Run({body, weights, fit, scan}, {}, context);
    truth = bulge;
  }
  Eigen::Vector3d PlaceOf(size_t v) const {
    return world.body.grid.ToMm(PointVox{world.body.grid.Ijk(v).cast<double>()}).lps;
  }
  HingeWorld world;
  PoseVector pose;
  DisplacementField example, truth;
};

TEST(ComputeExample, FindsTheDisplacementThatWasPutIn) {
  for (const double angle : {0.0, 0.7, 2.4}) {  // at 2.4 rad the blend needs its guard
    const RegisteredHinge hinge(angle);
    for (size_t v = 0; v < hinge.example.values.size(); ++v) {
      if (!hinge.world.body.values[v]) continue;
      ASSERT_LT((hinge.example.values[v] - hinge.truth.values[v]).norm(), 2e-3)
          << "voxel " << v << ", angle " << angle;
    }
  }
}

TEST(ComputeExample, FadesAwayFromTheBody) {
  const RegisteredHinge hinge(0.5);
  std::vector<double> distance = SquaredDistanceMm(hinge.world.body).values;
  for (double& d : distance) d = std::sqrt(d);
  size_t faded = 0;
  for (size_t v = 0; v < distance.size(); ++v) {
    if (distance[v] >= 10) {
      ASSERT_EQ(hinge.example.values[v], Eigen::Vector3f::Zero());
    }
    if (distance[v] > 0) {
      ASSERT_LE(hinge.example.values[v].norm(), hinge.truth.values[v].norm() + 2e-3);
    }
    faded += distance[v] > 4 && hinge.truth.values[v].norm() > 0.5f && hinge.example.values[v].norm() < 0.45f;
  }
  EXPECT_GT(faded, 0u);
}

TEST(ComputeExample, RigidPlacesHaveExactlyNoDisplacement) {
  const RegisteredHinge hinge(0.5);
  for (size_t v = 0; v < hinge.example.values.size(); ++v) {
    if (hinge.truth.values[v].norm() < 5e-4f) {
      ASSERT_EQ(hinge.example.values[v], Eigen::Vector3f::Zero());
    }
  }
}

}  // namespace
}  // namespace kvx
