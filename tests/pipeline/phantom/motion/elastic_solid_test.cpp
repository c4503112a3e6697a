// The solid against motions whose equilibrium is known: rest, rigid motions, a stretched bar.
#include "pipeline/phantom/motion/elastic_solid.h"

#include <gtest/gtest.h>

#include "pipeline/phantom/motion/poses.h"

namespace kvx::phantom {
namespace {

using V = Eigen::Vector3d;

// A bar along x, 40 x 12 x 12 mm, held at both ends.
struct Bar {
  TetMesh mesh;
  std::vector<uint8_t> fixed;
  std::unique_ptr<ElasticSolid> solid;

  explicit Bar(SolidOptions options = {}) {
    MeshDomain domain;
    domain.bounds = {V(-20, -6, -6), V(20, 6, 6)};
    domain.distance = [](const V& x) { return (x.cwiseAbs() - V(20, 6, 6)).maxCoeff(); };
    mesh = MakeTetMesh(domain, 3);
    for (const V& node : mesh.nodes) fixed.push_back(std::abs(node.x()) > 17);
    options.tolerance = 1e-5;
    options.max_iterations = 2000;
    solid = std::make_unique<ElasticSolid>(mesh, std::vector<TetMaterial>(mesh.tets.size()), fixed, options);
  }

  std::vector<V> Settled(const RigidTransform& left, const RigidTransform& right) const {
    std::vector<V> positions = mesh.nodes;
    for (size_t n = 0; n < positions.size(); ++n) {
      if (fixed[n]) positions[n] = Move(positions[n].x() < 0 ? left : right, positions[n]);
    }
    EXPECT_LT(solid->Settle(positions, {}).residual, 1e-5);
    return positions;
  }
};

TEST(ElasticSolid, ForcesAreTheSlopeOfTheEnergy) {
  const Bar bar;
  std::vector<V> positions = bar.mesh.nodes;
  for (size_t n = 0; n < positions.size(); ++n)
    positions[n] += V(std::sin(double(n)), std::cos(2.0 * n), std::sin(3.0 * n)) * 0.2;
  std::vector<double> activation(bar.mesh.tets.size(), 0.3);
  std::vector<TetMaterial> materials(bar.mesh.tets.size(), TetMaterial{1.5, V(1, 2, 2) / 3});
  const ElasticSolid solid(bar.mesh, materials, std::vector<uint8_t>(bar.mesh.nodes.size(), 0), {});
  const SolidContact contact{{3, 5, 9, 20, 30, 40}, {-0.2, -0.3, -0.1, -0.4, 0.6, 0.4}, V(2, -1, 2) / 3, -60};
  const SolidLoad load{activation, {&contact, 1}};
  std::vector<V> gradient;
  solid.Energy(positions, load, &gradient);
  for (const size_t n : {size_t(5), bar.mesh.nodes.size() / 2}) {
    for (int axis = 0; axis < 3; ++axis) {
      std::vector<V> up = positions, down = positions;
      up[n][axis] += 1e-5, down[n][axis] -= 1e-5;
      const double slope = (solid.Energy(up, load, nullptr) - solid.Energy(down, load, nullptr)) / 2e-5;
      EXPECT_NEAR(gradient[n][axis], slope, 1e-4 * (1 + std::abs(slope)));
    }
  }
}

TEST(ElasticSolid, StaysAtRestWhenNothingMoves) {
  const Bar bar;
  const std::vector<V> positions = bar.Settled({}, {});
  for (size_t n = 0; n < positions.size(); ++n) EXPECT_LT((positions[n] - bar.mesh.nodes[n]).norm(), 1e-9);
}

// In steps that a cube can follow, as BodyModel takes them: far jumps may lock inverted cubes.
TEST(ElasticSolid, FollowsARigidMotionOfItsBones) {
  const Bar bar;
  const V centre(3, 1, -2), axis(1, 2, -1);
  std::vector<V> positions = bar.mesh.nodes;
  for (int step = 1; step <= 5; ++step) {
    const RigidTransform motion = RotationAbout({centre}, axis, 0.08 * step);
    for (size_t n = 0; n < positions.size(); ++n) {
      if (bar.fixed[n]) positions[n] = Move(motion, bar.mesh.nodes[n]);
    }
    EXPECT_LT(bar.solid->Settle(positions, {}).residual, 1e-5);
  }
  const RigidTransform motion = RotationAbout({centre}, axis, 0.4);
  for (size_t n = 0; n < positions.size(); ++n) {
    // Corners of the mesh in the air outside may hang by one edge and swing; the bar itself may not.
    if (std::max(std::abs(bar.mesh.nodes[n].y()), std::abs(bar.mesh.nodes[n].z())) > 6) continue;
    EXPECT_LT((positions[n] - Move(motion, bar.mesh.nodes[n])).norm(), 0.01);
  }
}

TEST(ElasticSolid, AStretchedBarKeepsItsVolumeAndIsLinearInTheMiddle) {
  const Bar bar;
  const double stretch = 0.1;
  const std::vector<V> positions = bar.Settled({Eigen::Quaterniond::Identity(), V(-20 * stretch, 0, 0)},
                                               {Eigen::Quaterniond::Identity(), V(20 * stretch, 0, 0)});
  double volume = 0, least = 1;
  for (size_t t = 0; t < bar.mesh.tets.size(); ++t) {
    const double j = DeformationGradient(bar.mesh, positions, int(t)).determinant();
    volume += j / double(bar.mesh.tets.size());
    least = std::min(least, j);
    const V centre = bar.mesh.Centroid(int(t));
    if (std::abs(centre.x()) < 4) {
      EXPECT_NEAR(DeformationGradient(bar.mesh, positions, int(t))(0, 0), 1.12,
                  0.03);  // 4 mm over the 34 mm between the grips
    }
  }
  EXPECT_GT(volume, 1.0);
  EXPECT_LT(volume,
            1.0 + 0.35 * stretch);  // a solid without lateral contraction would gain the whole stretch
  EXPECT_GT(least, 0.7);
}

TEST(TetMesh, LocatesEveryRestPointInTheTetrahedronThatHoldsIt) {
  const Bar bar;
  Random random(7, "points");
  for (int i = 0; i < 200; ++i) {
    const double x = random.Uniform(-20, 20), y = random.Uniform(-6, 6);
    const V rest(x, y, random.Uniform(-6, 6));
    const TetLocation location = bar.mesh.Locate(rest);
    ASSERT_GE(location.tet, 0);
    V sum = V::Zero();
    for (int n = 0; n < 4; ++n) {
      EXPECT_GE(location.weights[size_t(n)], -1e-12);
      sum += location.weights[size_t(n)] *
             bar.mesh.nodes[size_t(bar.mesh.tets[size_t(location.tet)][size_t(n)])];
    }
    EXPECT_LT((sum - rest).norm(), 1e-9);
  }
}

}  // namespace
}  // namespace kvx::phantom
