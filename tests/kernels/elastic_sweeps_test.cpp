// Elastic lattices: rest and rigid motions are equilibria, affine stretches stay affine, the energy never
// rises, and cells that are inside out come right; on the device and for its twin.
#include "kernels/elastic_sweeps.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <functional>
#include <random>

#include "kernels/reference/elastic_relaxation.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

// The device or its twin.
struct Relaxer {
  const char* name;
  bool on_device;
};

class ElasticRelaxation : public testing::TestWithParam<Relaxer> {
 protected:
  static void Relax(ElasticLattice& lattice, int sweeps) {
    if (GetParam().on_device)
      ElasticSweeps{SharedBackend()}(lattice, sweeps);
    else
      reference::Relax(lattice, sweeps);
  }
  static void Relax(ElasticLattice& lattice, int sweeps, std::span<const uint32_t> nodes) {
    if (GetParam().on_device)
      ElasticSweeps{SharedBackend()}(lattice, sweeps, nodes);
    else
      reference::Relax(lattice, sweeps, nodes);
  }
};
INSTANTIATE_TEST_SUITE_P(Both, ElasticRelaxation,
                         testing::Values(Relaxer{"Device", true}, Relaxer{"Twin", false}),
                         [](const auto& one) { return one.param.name; });

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

TEST_P(ElasticRelaxation, ARigidMotionHasNoEnergyAndStays) {
  for (const double handedness : {1.0, -1.0}) {
    ElasticLattice lattice = Box(Rigid, handedness);
    EXPECT_NEAR(reference::ElasticEnergy(lattice), 0, 1e-3);
    const ElasticLattice before = lattice;
    Relax(lattice, 5);
    EXPECT_LT(Furthest(lattice, before), 1e-4);
  }
}

// Of every frame, eight to a cell: half of |F|^2 - 3, less J - 1, and half of 12 (J - 1)^2.
TEST(ElasticLattice, AnAffineMapHasTheEnergyOfItsGradientInEveryFrame) {
  Eigen::Matrix3d map;
  map << 1.3, 0.2, 0, -0.1, 0.8, 0.1, 0, 0.15, 1.1;
  const double change = map.determinant() - 1;
  const double frame = 0.5 * (map.squaredNorm() - 3) - change + 6 * change * change;
  for (const double handedness : {1.0, -1.0}) {
    const ElasticLattice lattice =
        Box([&](const Eigen::Vector3d& x) { return Eigen::Vector3d(map * x); }, handedness);
    const double frames = 8 * (lattice.size.array() - 1).prod();
    EXPECT_NEAR(reference::ElasticEnergy(lattice) / frames, frame, 1e-5 * frame) << handedness;
  }
}

// With all faces held, a homogeneous stretch is the equilibrium of the inside.
TEST_P(ElasticRelaxation, AShakenStretchComesBackToIt) {
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

TEST_P(ElasticRelaxation, TheEnergyNeverRisesAndInvertedCellsComeRight) {
  ElasticLattice lattice = Box([](const Eigen::Vector3d& x) { return x; });
  const ElasticLattice rest = lattice;
  Shake(lattice, 1.6);  // more than an edge: many frames are inside out
  double energy = reference::ElasticEnergy(lattice);
  EXPECT_GT(energy, 100);
  for (int sweep = 0; sweep < 12; ++sweep) {
    Relax(lattice, 1);
    const double next = reference::ElasticEnergy(lattice);
    EXPECT_LE(next, energy * 1.0001) << "sweep " << sweep;
    energy = next;
  }
  Relax(lattice, 80);
  EXPECT_LT(Furthest(lattice, rest), 2e-3);
}

// A long bar with free sides, stretched by s and thinner by t:
// no stress across it means s t^2 = 1 + (1 - 1/s) / volume stiffness.
TEST_P(ElasticRelaxation, AStretchedBarGrowsThinAsItsVolumeStiffnessSays) {
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
TEST_P(ElasticRelaxation, AHoldAndTheTissueMeetInBetween) {
  ElasticLattice lattice = Box([](const Eigen::Vector3d& x) { return x; });
  const size_t node = lattice.Index(3, 3, 4);
  for (size_t n = 0; n < lattice.kinds.size(); ++n) lattice.kinds[n] = NodeKind::kFixed;
  lattice.kinds[node] = NodeKind::kFree;
  const std::vector<Eigen::Vector3f> rest = lattice.positions_mm;
  lattice.positions_mm[node].y() += 0.5f;
  const double k = 2 * reference::ElasticEnergy(lattice) / (0.5 * 0.5), h = 0.7 * k, t = 0.8;
  lattice.positions_mm = rest;
  std::vector<Eigen::Vector3f> held_mm = rest;
  held_mm[node].y() += float(t);
  std::vector<Eigen::Matrix3f> holds(rest.size(), Eigen::Matrix3f::Zero());
  holds[node](1, 1) = float(h);
  lattice.held_mm = held_mm, lattice.holds = holds;
  double energy = reference::ElasticEnergy(lattice);
  EXPECT_NEAR(energy, 0.5 * h * t * t, 1e-3 * energy);
  for (int sweep = 0; sweep < 40; ++sweep) {
    Relax(lattice, 1);
    EXPECT_LE(reference::ElasticEnergy(lattice), energy * 1.0001);
    energy = reference::ElasticEnergy(lattice);
  }
  EXPECT_NEAR(lattice.positions_mm[node].y() - rest[node].y(), h * t / (k + h), 1e-3);
}

TEST(ElasticLattice, NodesOfOneCellShareItsHold) {
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

TEST_P(ElasticRelaxation, OnlyNamedFreeNodesMove) {
  ElasticLattice lattice = Box([](const Eigen::Vector3d& x) { return x; });
  Shake(lattice, 0.4);
  const ElasticLattice before = lattice;
  const std::vector<uint32_t> nodes = {0, uint32_t(lattice.Index(3, 3, 3))};
  Relax(lattice, 2, nodes);
  for (size_t n = 0; n < before.positions_mm.size(); ++n)
    EXPECT_EQ(lattice.positions_mm[n] != before.positions_mm[n], n == nodes[1]) << n;
}

// The first sweep looks at all nodes; where it moves none the others find nothing to do.
TEST(ElasticSweeps, LeaveBeWhatIsAtEase) {
  const auto swept = [](int sweeps) {
    ElasticLattice lattice = Box(Rigid);
    lattice.still_mm = 1e-3f;
    ElasticSweeps{SharedBackend()}(lattice, sweeps);
    return lattice.positions_mm;
  };
  EXPECT_EQ(swept(1), swept(30));
}

// A disturbance spreads from where it is to all that it reaches, and is lost only where it has all but ended.
TEST(ElasticSweeps, WakeWhatLiesBesideMotion) {
  for (const Eigen::Vector3i& at : {Eigen::Vector3i(3, 3, 4), Eigen::Vector3i(1, 4, 1)}) {
    ElasticLattice all = Box([](const Eigen::Vector3d& x) { return x; });
    const size_t node = all.Index(at.x(), at.y(), at.z());
    all.positions_mm[node] += Eigen::Vector3f(0.4f, -0.3f, 0.5f);
    all.kinds[node] = NodeKind::kFixed;
    ElasticLattice lazy = all;
    lazy.still_mm = 1e-4f;
    ElasticSweeps{SharedBackend()}(lazy, 60);
    reference::Relax(all, 60);
    EXPECT_LT(Furthest(lazy, all), 10 * lazy.still_mm);
    EXPECT_GT(Furthest(all, Box([](const Eigen::Vector3d& x) { return x; })), 0.1);
  }
}

// What lies at ease at one end of a long bar knows nothing of motion at the other: both ends of a row lie
// side by side in memory. The noise is too small to wake anything.
TEST(ElasticSweeps, DoNotWakeTheOtherEndOfARow) {
  for (const int length : {300, 301, 306}) {
    ElasticLattice bar;
    bar.size = {length, 6, 6};
    bar.still_mm = 1e-3f;
    std::mt19937 random(3);
    std::uniform_real_distribution<float> step(-0.1f * bar.still_mm, 0.1f * bar.still_mm);
    for (size_t n = 0; n < size_t(bar.size.prod()); ++n) {
      const Eigen::Vector3i p = bar.NodeAt(n);
      const bool end = p.x() == 0 || p.x() == length - 1;
      bar.kinds.push_back(end ? NodeKind::kFixed : NodeKind::kFree);
      uint8_t joined = 0;
      for (int a = 0; a < 3; ++a) joined |= uint8_t(p[a] + 1 < bar.size[a]) << a;
      bar.joined.push_back(joined);
      bar.positions_mm.push_back(p.cast<float>());
      if (!end) bar.positions_mm.back() += Eigen::Vector3f(step(random), step(random), step(random));
    }
    for (const int from_end : {2, 5, 20})
      bar.positions_mm[bar.Index(length - 1 - from_end, 3, 3)] += Eigen::Vector3f(0.3f, -0.2f, 0.25f);
    ElasticLattice once = bar;
    ElasticSweeps{SharedBackend()}(once, 1);
    ElasticSweeps{SharedBackend()}(bar, 30);
    for (size_t n = 0; n < bar.positions_mm.size(); ++n) {
      if (bar.NodeAt(n).x() < 40) {
        ASSERT_EQ(bar.positions_mm[n], once.positions_mm[n]) << bar.NodeAt(n).transpose() << ", " << length;
      }
    }
  }
}

// Holes, tissue and air, bone, grades of stiffness and holds, all at random.
ElasticLattice Patchwork(int hold_nodes, bool graded, std::vector<Eigen::Matrix3f>& holds,
                         std::vector<Eigen::Vector3f>& held_mm) {
  ElasticLattice out;
  out.size = {22, 10, 8};
  out.rest_spacing_mm = {1.0, 1.5, 2.0};
  out.handedness = -1;
  std::mt19937 random(11);
  const auto uniform = [&] { return float(random() % 1000) / 1000; };
  for (size_t n = 0; n < size_t(out.size.prod()); ++n) {
    const float kind = uniform();
    out.kinds.push_back(kind < 0.1f ? NodeKind::kAbsent : kind < 0.2f ? NodeKind::kFixed : NodeKind::kFree);
    out.joined.push_back(uint8_t(random() % 8));
    if (graded) out.stiffness.push_back(1 + 9 * uniform());
    Eigen::Vector3d rest = out.NodeAt(n).cast<double>().cwiseProduct(out.rest_spacing_mm);
    rest.z() = -rest.z();
    held_mm.push_back(Rigid(rest).cast<float>());
    out.positions_mm.push_back(held_mm.back() + 0.3f * Eigen::Vector3f(uniform(), uniform(), uniform()));
  }
  for (int c = 0; c < (out.size / hold_nodes).prod(); ++c) {
    const Eigen::Vector3f along(uniform(), uniform(), uniform());
    holds.push_back(5 * along * along.transpose());
  }
  out.holds = holds, out.held_mm = held_mm, out.hold_nodes = hold_nodes;
  return out;
}

TEST(ElasticSweeps, AgreeWithTheirTwin) {
  for (const auto& [hold_nodes, graded] : {std::pair{1, false}, std::pair{2, true}}) {
    std::vector<Eigen::Matrix3f> holds;
    std::vector<Eigen::Vector3f> held_mm;
    ElasticLattice device = Patchwork(hold_nodes, graded, holds, held_mm);
    const ElasticLattice before = device;
    ElasticLattice twin = device;
    ElasticSweeps{SharedBackend()}(device, 3);
    reference::Relax(twin, 3);
    EXPECT_LT(Furthest(device, twin), 1e-3);
    EXPECT_GT(Furthest(device, before), 0.2);
    ElasticLattice loose = before;
    loose.holds = {};
    ElasticSweeps{SharedBackend()}(loose, 3);
    EXPECT_GT(Furthest(device, loose), 0.01);  // the holds did something
  }
}

// The energy around one node is quadratic in its place, so that differences over any step are exact.
struct Around {
  explicit Around(ElasticLattice lattice, size_t node) {
    constexpr float kStepMm = 0.25f;
    const Eigen::Vector3f place_mm = lattice.positions_mm[node];
    const auto energy = [&](const Eigen::Vector3f& away_mm) {
      lattice.positions_mm[node] = place_mm + away_mm;
      return reference::ElasticEnergy(lattice);
    };
    for (int a = 0; a < 3; ++a) {
      const Eigen::Vector3f u = kStepMm * Eigen::Vector3f::Unit(a);
      slope[a] = (energy(u) - energy(-u)) / (2 * kStepMm);
      for (int b = 0; b < 3; ++b) {
        const Eigen::Vector3f w = kStepMm * Eigen::Vector3f::Unit(b);
        curvature(a, b) =
            (energy(u + w) + energy(-u - w) - energy(u - w) - energy(w - u)) / (4 * kStepMm * kStepMm);
      }
    }
  }
  Eigen::Vector3d slope;
  Eigen::Matrix3d curvature;
};

// By so much more as sweeps go too far on purpose. Only rounding is left: of energies in single precision.
TEST_P(ElasticRelaxation, ANodeGoesWhereSlopeAndCurvatureOfTheEnergySay) {
  for (const auto& [hold_nodes, graded] : {std::pair{1, false}, std::pair{2, true}}) {
    std::vector<Eigen::Matrix3f> holds;
    std::vector<Eigen::Vector3f> held_mm;
    const ElasticLattice before = Patchwork(hold_nodes, graded, holds, held_mm);
    std::vector<uint32_t> nodes;  // of one colour, which do not see each other move
    for (uint32_t n = 0; n < before.kinds.size(); ++n) {
      const Eigen::Vector3i p = before.NodeAt(n);
      if (before.kinds[n] == NodeKind::kFree && p.x() % 6 == 1 && p.y() % 2 && p.z() % 2) nodes.push_back(n);
    }
    EXPECT_GT(nodes.size(), 40);
    ElasticLattice after = before;
    Relax(after, 1, nodes);
    for (const uint32_t n : nodes) {
      const Around around(before, n);
      const Eigen::Vector3d step = -kElasticOverRelaxation * around.curvature.llt().solve(around.slope);
      const Eigen::Vector3d gone = (after.positions_mm[n] - before.positions_mm[n]).cast<double>();
      EXPECT_LT((gone - step).norm(), 1e-4 * step.norm() + 5e-6) << n;
    }
  }
}

TEST(ElasticSweeps, OfAPreparedLatticeGoOnWhateverHoldsIt) {
  std::vector<Eigen::Matrix3f> holds;
  std::vector<Eigen::Vector3f> held_mm;
  ElasticLattice anew = Patchwork(1, true, holds, held_mm), prepared = anew;
  const ElasticSweeps sweeps(SharedBackend());
  const auto stays = sweeps.Prepare(prepared);
  for (int call = 0; call < 3; ++call) {
    sweeps(anew, 2), sweeps(*stays, prepared, 2);
    EXPECT_EQ(Furthest(anew, prepared), 0) << call;
    for (Eigen::Matrix3f& hold : holds) hold *= 3;
  }
}

}  // namespace
}  // namespace kvx
