// Elastic lattices: rest and rigid motions are equilibria, affine stretches stay affine, the energy never
// rises, and cells that are inside out come right.
#include "pipeline/registration/elastic_relaxation.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <random>

#include "pipeline/registration/fold_repair.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;
using Map = std::function<Eigen::Vector3d(const Eigen::Vector3d&)>;  // rest mm -> mm

// A box of tissue whose faces are held.
ElasticLattice Box(const Map& map, double handedness = 1) {
  ElasticLattice out;
  out.size = {7, 6, 8};
  out.rest_spacing_mm = {1.0, 1.5, 2.0};
  out.handedness = handedness;
  for (int k = 0; k < out.size.z(); ++k) {
    for (int j = 0; j < out.size.y(); ++j) {
      for (int i = 0; i < out.size.x(); ++i) {
        const Eigen::Vector3i p(i, j, k);
        const bool face = (p.array() == 0).any() || (p.array() == out.size.array() - 1).any();
        out.kinds.push_back(face ? NodeKind::kFixed : NodeKind::kFree);
        uint8_t joined = 0;
        for (int a = 0; a < 3; ++a) joined |= uint8_t(p[a] + 1 < out.size[a]) << a;
        out.joined.push_back(joined);
        Eigen::Vector3d rest = p.cast<double>().cwiseProduct(out.rest_spacing_mm);
        rest.z() *= handedness;
        out.positions_mm.push_back(map(rest).cast<float>());
      }
    }
  }
  return out;
}

void Shake(ElasticLattice& lattice, double mm) {
  std::mt19937 random(3);
  std::uniform_real_distribution<float> step(float(-mm), float(mm));
  for (size_t n = 0; n < lattice.kinds.size(); ++n) {
    if (lattice.kinds[n] == NodeKind::kFree)
      lattice.positions_mm[n] += Eigen::Vector3f(step(random), step(random), step(random));
  }
}

double Furthest(const ElasticLattice& a, const ElasticLattice& b) {
  double out = 0;
  for (size_t n = 0; n < a.positions_mm.size(); ++n)
    out = std::max<double>(out, (a.positions_mm[n] - b.positions_mm[n]).norm());
  return out;
}

Eigen::Vector3d Rigid(const Eigen::Vector3d& x) {
  return Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, 3).normalized()) * x + Eigen::Vector3d(5, -4, 3);
}

TEST(ElasticRelaxation, ARigidMotionHasNoEnergyAndStays) {
  for (const double handedness : {1.0, -1.0}) {
    ElasticLattice lattice = Box(Rigid, handedness);
    EXPECT_NEAR(ElasticEnergy(lattice), 0, 1e-3);
    const ElasticLattice before = lattice;
    Relax(lattice, 5);
    EXPECT_LT(Furthest(lattice, before), 1e-4);
  }
}

// With all faces held, a homogeneous stretch is the equilibrium of the inside.
TEST(ElasticRelaxation, AShakenStretchComesBackToIt) {
  Eigen::Matrix3d stretch;
  stretch << 1.3, 0.2, 0, -0.1, 0.8, 0.1, 0, 0.15, 1.1;
  const auto map = [&](const Eigen::Vector3d& x) { return Eigen::Vector3d(stretch * x); };
  const ElasticLattice right = Box(map);
  ElasticLattice lattice = right;
  Shake(lattice, 0.4);
  EXPECT_GT(Furthest(lattice, right), 0.3);
  Relax(lattice, 80);
  EXPECT_LT(Furthest(lattice, right), 2e-3);
}

TEST(ElasticRelaxation, TheEnergyNeverRisesAndInvertedCellsComeRight) {
  ElasticLattice lattice = Box([](const Eigen::Vector3d& x) { return x; });
  const ElasticLattice rest = lattice;
  Shake(lattice, 1.6);  // more than an edge: many frames are inside out
  double energy = ElasticEnergy(lattice);
  EXPECT_GT(energy, 100);
  for (int sweep = 0; sweep < 12; ++sweep) {
    Relax(lattice, 1);
    const double next = ElasticEnergy(lattice);
    EXPECT_LE(next, energy * 1.0001) << "sweep " << sweep;
    energy = next;
  }
  Relax(lattice, 80);
  EXPECT_LT(Furthest(lattice, rest), 2e-3);
}

// A long bar with free sides, stretched by s and thinner by t:
// no stress across it means s t^2 = 1 + (1 - 1/s) / volume stiffness.
TEST(ElasticRelaxation, AStretchedBarGrowsThinAsItsVolumeStiffnessSays) {
  const double stretch = 1.1;
  const int length = 25;
  ElasticLattice lattice;
  lattice.size = {3, 3, length};
  lattice.rest_spacing_mm = {1.0, 1.5, 2.0};
  for (int n = 0; n < 9 * length; ++n) {
    const Eigen::Vector3i p(n % 3, n / 3 % 3, n / 9);
    const bool end = p.z() == 0 || p.z() + 1 == length;
    lattice.kinds.push_back(end ? NodeKind::kFixed : NodeKind::kFree);
    lattice.joined.push_back(uint8_t((p.x() < 2) | (p.y() < 2) << 1 | (p.z() + 1 < length) << 2));
    const Eigen::Vector3d rest = p.cast<double>().cwiseProduct(lattice.rest_spacing_mm);
    lattice.positions_mm.push_back(Eigen::Vector3f(rest.x(), rest.y(), stretch * rest.z()));
  }
  Relax(lattice, 600);
  const int z = length / 2;  // far from the held ends, which stay as wide as they were
  const auto apart = [&](size_t a, size_t b) {
    return double((lattice.positions_mm[a] - lattice.positions_mm[b]).norm()) / 2;
  };
  const double s =
      apart(lattice.Index(1, 1, z + 1), lattice.Index(1, 1, z - 1)) / lattice.rest_spacing_mm.z();
  EXPECT_NEAR(s, stretch, 0.01);
  const double t = std::sqrt((1 + (1 - 1 / s) / lattice.volume_stiffness) / s);
  EXPECT_NEAR(apart(lattice.Index(2, 1, z), lattice.Index(0, 1, z)) / lattice.rest_spacing_mm.x(), t, 1e-3);
  EXPECT_NEAR(apart(lattice.Index(1, 2, z), lattice.Index(1, 0, z)) / lattice.rest_spacing_mm.y(), t, 1e-3);
}

// One free node between held ones: its energy is k u^2 / 2 along an axis, so a hold of h at distance t leaves
// it at h t / (k + h).
TEST(ElasticRelaxation, AHoldAndTheTissueMeetInBetween) {
  ElasticLattice lattice = Box([](const Eigen::Vector3d& x) { return x; });
  const size_t node = lattice.Index(3, 3, 4);
  for (size_t n = 0; n < lattice.kinds.size(); ++n) lattice.kinds[n] = NodeKind::kFixed;
  lattice.kinds[node] = NodeKind::kFree;
  const std::vector<Eigen::Vector3f> rest = lattice.positions_mm;
  lattice.positions_mm[node].y() += 0.5f;
  const double k = 2 * ElasticEnergy(lattice) / (0.5 * 0.5), h = 0.7 * k, t = 0.8;
  lattice.positions_mm = rest;
  std::vector<Eigen::Vector3f> held_mm = rest;
  held_mm[node].y() += float(t);
  std::vector<Eigen::Matrix3f> holds(rest.size(), Eigen::Matrix3f::Zero());
  holds[node](1, 1) = float(h);
  lattice.held_mm = held_mm, lattice.holds = holds;
  double energy = ElasticEnergy(lattice);
  EXPECT_NEAR(energy, 0.5 * h * t * t, 1e-3 * energy);
  for (int sweep = 0; sweep < 40; ++sweep) {
    Relax(lattice, 1);
    EXPECT_LE(ElasticEnergy(lattice), energy * 1.0001);
    energy = ElasticEnergy(lattice);
  }
  EXPECT_NEAR(lattice.positions_mm[node].y() - rest[node].y(), h * t / (k + h), 1e-3);
}

TEST(ElasticRelaxation, NodesOfOneCellShareItsHold) {
  ElasticLattice lattice;
  lattice.size = {4, 2, 6};
  std::vector<Eigen::Matrix3f> holds;
  for (int c = 0; c < 2 * 1 * 3; ++c) holds.push_back(float(c) * Eigen::Matrix3f::Identity());
  lattice.holds = holds;
  lattice.hold_nodes = 2;
  EXPECT_EQ(lattice.HoldOf({1, 1, 0})(0, 0), 0);
  EXPECT_EQ(lattice.HoldOf({2, 0, 1})(0, 0), 1);
  EXPECT_EQ(lattice.HoldOf({3, 1, 5})(0, 0), 5);
}

TEST(ElasticRelaxation, OnlyNamedFreeNodesMove) {
  ElasticLattice lattice = Box([](const Eigen::Vector3d& x) { return x; });
  Shake(lattice, 0.4);
  const ElasticLattice before = lattice;
  const std::vector<uint32_t> nodes = {0, uint32_t(lattice.Index(3, 3, 3))};
  Relax(lattice, 2, nodes);
  for (size_t n = 0; n < before.positions_mm.size(); ++n)
    EXPECT_EQ(lattice.positions_mm[n] != before.positions_mm[n], n == nodes[1]) << n;
}

// A crease: planes of voxels that have swapped places. Bone beside it stays where it is.
TEST(FoldRepair, ACreaseIsOpenedAndBoneStays) {
  const Mask body(ObliqueGrid({16, 16, 16}), 1);
  LabelMap bones(body.grid);
  for (int k = 0; k < 16; ++k) bones(4, 8, k) = 1;
  const WorkRegion region{Eigen::Vector3i::Zero(), body.grid};
  std::vector<Eigen::Vector3f> scan_mm;
  for (size_t v = 0; v < body.values.size(); ++v) {
    Eigen::Vector3d p = body.grid.Ijk(v).cast<double>();
    const double deep = std::exp(-0.05 * (p - Eigen::Vector3d(9, 8, 8)).squaredNorm());
    if (body.grid.Ijk(v).x() >= 8 && !bones.values[v]) p.x() -= 2.5 * deep;
    scan_mm.push_back(body.grid.ToMm(PointVox{p}).lps.cast<float>());
  }
  const std::vector<Eigen::Vector3f> before = scan_mm;
  const auto folded = [&] {
    int count = 0;
    for (size_t v = 0; v < scan_mm.size(); ++v)
      count += Determinant(scan_mm, region, body.grid, body.grid.Ijk(v)) <= 0;
    return count;
  };
  EXPECT_GT(folded(), 10);
  Unfold(bones, body, region, scan_mm);
  EXPECT_EQ(folded(), 0);
  for (size_t v = 0; v < scan_mm.size(); ++v) {
    if (bones.values[v]) EXPECT_EQ(scan_mm[v], before[v]);
  }
}

// Two bones with one voxel of tissue in between, found `overlap` voxels inside one another.
struct Joint {
  Mask body{ObliqueGrid({18, 12, 12}), 1};
  LabelMap bones{body.grid};
  WorkRegion region{Eigen::Vector3i::Zero(), body.grid};
  std::vector<Eigen::Vector3f> scan_mm;

  explicit Joint(double overlap) {
    for (size_t v = 0; v < body.values.size(); ++v) {
      const Eigen::Vector3i p = body.grid.Ijk(v);
      const bool across = std::max(std::abs(p.y() - 6), std::abs(p.z() - 6)) <= 2;
      bones.values[v] = !across ? 0 : p.x() >= 5 && p.x() <= 8 ? 1 : p.x() >= 10 && p.x() <= 13 ? 2 : 0;
      Eigen::Vector3d to = p.cast<double>();
      if (p.x() > 9) to.x() -= 1 + overlap;
      scan_mm.push_back(body.grid.ToMm(PointVox{to}).lps.cast<float>());
    }
  }
  int Folded() const {
    int count = 0;
    for (size_t v = 0; v < scan_mm.size(); ++v)
      count += Determinant(scan_mm, region, body.grid, body.grid.Ijk(v)) <= 0;
    return count;
  }
};

TEST(FoldRepair, BonesInsideOneAnotherLeaveNoFold) {
  Joint joint(1.2);
  const std::vector<Eigen::Vector3f> before = joint.scan_mm;
  EXPECT_GT(joint.Folded(), 20);
  Unfold(joint.bones, joint.body, joint.region, joint.scan_mm);
  EXPECT_EQ(joint.Folded(), 0);
  for (size_t v = 0; v < before.size(); ++v) {  // away from the contact bone is where it was
    const int x = joint.body.grid.Ijk(v).x();
    if (joint.bones.values[v] && (x == 5 || x == 13)) EXPECT_EQ(joint.scan_mm[v], before[v]);
  }
}

TEST(FoldRepair, AMapWithoutFoldsIsLeftAsItIs) {
  const Mask body(ObliqueGrid({8, 8, 8}), 1);
  const WorkRegion region{Eigen::Vector3i::Zero(), body.grid};
  std::vector<Eigen::Vector3f> scan_mm;
  for (size_t v = 0; v < body.values.size(); ++v)
    scan_mm.push_back(Rigid(body.grid.ToMm(PointVox{body.grid.Ijk(v).cast<double>()}).lps).cast<float>());
  const std::vector<Eigen::Vector3f> before = scan_mm;
  EXPECT_NEAR(Determinant(scan_mm, region, body.grid, {3, 4, 5}), 1, 1e-4);
  Unfold(LabelMap(body.grid), body, region, scan_mm);
  EXPECT_EQ(scan_mm, before);
}

}  // namespace
}  // namespace kvx
