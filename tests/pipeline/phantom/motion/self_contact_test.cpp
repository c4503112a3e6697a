// Two bars side by side: how deep they overlap is known, and pressed together they meet half way.
#include "pipeline/phantom/motion/self_contact.h"

#include <gtest/gtest.h>

namespace kvx::phantom {
namespace {

using V = Eigen::Vector3d;

// Along z, 12 mm wide, their facing sides 12 mm apart at rest.
struct TwoBars {
  TetMesh mesh;
  std::vector<uint8_t> outer;  // nodes of the sides that do not face each other

  TwoBars() {
    MeshDomain domain;
    domain.bounds = {V(-18, -6, -9), V(18, 6, 9)};
    domain.distance = Skin;
    mesh = MakeTetMesh(domain, 3);
    for (const V& node : mesh.nodes) outer.push_back(std::abs(node.x()) > 14);
  }
  static double Skin(const V& x) {
    return (V(std::abs(std::abs(x.x()) - 12), std::abs(x.y()), std::abs(x.z())) - V(6, 6, 9)).maxCoeff();
  }
  std::vector<V> Moved(double inwards_mm) const {
    std::vector<V> out = mesh.nodes;
    for (V& node : out) node.x() += node.x() < 0 ? inwards_mm : -inwards_mm;
    return out;
  }
};

TEST(SelfContact, FindsNothingWherePartsAreApart) {
  const TwoBars bars;
  const SelfContact contact(bars.mesh, TwoBars::Skin);
  EXPECT_TRUE(contact.Find(bars.mesh.nodes).empty());
  EXPECT_EQ(OverlapMm(contact.Find(bars.Moved(3))), 0);
}

TEST(SelfContact, SaysHowDeepAndWhichWayOut) {
  const TwoBars bars;
  const auto found = SelfContact(bars.mesh, TwoBars::Skin).Find(bars.Moved(7));
  ASSERT_FALSE(found.empty());
  EXPECT_NEAR(OverlapMm(found), 2, 1e-6);  // 12 mm apart, moved by 14
  for (const SolidContact& contact : found) {
    V apart = V::Zero();
    double sum = 0;
    const std::vector<V> posed = bars.Moved(7);
    for (size_t n = 0; n < 6; ++n) {
      apart += contact.weights[n] * posed[size_t(contact.nodes[n])], sum += contact.weights[n];
    }
    EXPECT_LT(apart.norm(), 1e-9);
    EXPECT_NEAR(sum, 0, 1e-12);
    const double side = bars.mesh.nodes[size_t(contact.nodes[4])].x() < 0 ? -1 : 1;
    if (contact.gap_mm < 0) {
      EXPECT_GT(side * contact.normal.x(), 0.99);
    }
  }
}

TEST(SelfContact, BarsThatArePressedTogetherMeetHalfWay) {
  const TwoBars bars;
  const SelfContact contact(bars.mesh, TwoBars::Skin);
  const ElasticSolid solid(bars.mesh, std::vector<TetMaterial>(bars.mesh.tets.size()), bars.outer, {});
  std::vector<V> positions = bars.Moved(7);
  for (int round = 0; round < 4; ++round) {
    const std::vector<SolidContact> found = contact.Find(positions);
    solid.Settle(positions, {{}, found});
  }
  for (size_t n = 0; n < positions.size(); ++n) {
    const V& rest = bars.mesh.nodes[n];
    const bool facing = std::abs(std::abs(rest.x()) - 6) < 0.1;
    const bool at_an_edge = std::abs(rest.y()) > 4 || std::abs(rest.z()) > 7;
    if (facing && !at_an_edge) {
      EXPECT_NEAR(positions[n].x(), 0, 0.1);
    }
  }
  EXPECT_LT(OverlapMm(contact.Find(positions)), 0.4);  // at edges, where the distance has a kink
}

}  // namespace
}  // namespace kvx::phantom
