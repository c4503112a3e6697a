// The posing engine against a Newton inverse in double, its own planes,
// regions and levels, and parts that draw apart.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "kernels/reference/evd.h"
#include "pipeline/posing/brick_body.h"
#include "tests/support/fixtures.h"
#include "tests/support/hinge_world.h"

namespace kvx {
namespace {
using namespace testing_support;
using Eigen::Matrix3d, Eigen::Vector3d, Eigen::Vector3i;

// The forward map between its nodes, trilinear, in double.
struct Forward {
  BrickedBody body;
  reference::Places posed;

  Forward(const PosingInputs& inputs, const ResolvedPose& pose)
      : body(BrickBody(inputs)),
        posed(reference::EvdForward(body, inputs.body.grid, inputs.body.grid, pose.scan_from_template,
                                    pose.coefficients)) {}
  // False where no cell is stored.
  bool At(const Vector3d& v, Vector3d& place, Matrix3d& slope) const {
    const Vector3i low = v.array().floor().cast<int>();
    const int brick = body.BrickOf(low);
    if (brick < 0 || brick >= body.cell_bricks) return false;
    const Vector3d f = v - low.cast<double>();
    place.setZero(), slope.setZero();
    for (int n = 0; n < 8; ++n) {
      const Vector3i d(n & 1, (n >> 1) & 1, n >> 2), node = low + d;
      const Vector3d p = posed[size_t(body.BrickOf(node)) * 64 + size_t(BrickedBody::Slot(node))];
      Vector3d part, sign;
      for (int a = 0; a < 3; ++a) part[a] = d[a] ? f[a] : 1 - f[a], sign[a] = d[a] ? 1 : -1;
      place += part.prod() * p;
      for (int a = 0; a < 3; ++a) slope.col(a) += sign[a] * part[(a + 1) % 3] * part[(a + 2) % 3] * p;
    }
    return true;
  }
  // Newton from `v` to where the map meets p; false where it finds nothing within 2 voxels of its start.
  bool Invert(const Vector3d& p, Vector3d& v) const {
    const Vector3d start = v;
    Vector3d place;
    Matrix3d slope;
    for (int step = 0; step < 50; ++step) {
      if (!At(v, place, slope)) return false;
      if ((p - place).norm() < 1e-9) return (v - start).norm() < 2;
      const Vector3d move = slope.fullPivLu().solve(p - place);
      v += move * std::min(1.0, 0.5 / move.norm());
    }
    return (p - place).norm() < 1e-6 && (v - start).norm() < 2;
  }
};

// Whether a place lies between bone and other tissue, where the bone's own motion decides.
bool IsBesideBone(const LabelMap& labels, const Vector3d& at) {
  const Vector3i low = at.array().floor().cast<int>(), last = labels.grid.size - Vector3i::Ones();
  bool bone = false, other = false;
  for (int n = 0; n < 8; ++n) {
    const Vector3i node = (low + Vector3i(n & 1, (n >> 1) & 1, n >> 2)).cwiseMax(0).cwiseMin(last);
    (labels(node.x(), node.y(), node.z()) ? bone : other) = true;
  }
  return bone && other;
}

// measure(forward, voxel, the template place that the engine finds there) of every posed voxel that comes
// from the body and not from beside a bone, in rising order; what is not finite is left out.
template <class Measure>
std::vector<double> OverTheBody(const PosingInputs& inputs, const ResolvedPose& pose, Measure measure) {
  const PosingEngine engine(SharedBackend(), inputs);
  const Grid& grid = inputs.body.grid;
  const PlaceField found = engine.InversePlaces(pose, grid);
  const Forward forward(inputs, pose);
  std::vector<double> measures;
  for (size_t v = 0; v < found.values.size(); ++v) {
    if (!std::isfinite(found.values[v].x())) continue;
    const Vector3d at = grid.ToVox(PointMm{found.values[v].cast<double>()}).ijk;
    if (!forward.body.IsBody(at.array().round().cast<int>()) || IsBesideBone(inputs.bones.labels, at))
      continue;
    const double value = measure(forward, grid.Ijk(v).cast<double>(), at);
    if (std::isfinite(value)) measures.push_back(value);
  }
  std::sort(measures.begin(), measures.end());
  return measures;
}

// Distances in template voxels between the engine's inverse and Newton's.
std::vector<double> InverseErrors(const PosingInputs& inputs, const ResolvedPose& pose) {
  return OverTheBody(inputs, pose, [](const Forward& forward, const Vector3d& voxel, const Vector3d& at) {
    Vector3d truth = at;
    return forward.Invert(voxel, truth) ? (truth - at).norm() : NAN;
  });
}

// How far the forward map of each found place misses its voxel, posed voxels.
std::vector<double> Misses(const PosingInputs& inputs, const ResolvedPose& pose) {
  return OverTheBody(inputs, pose, [](const Forward& forward, const Vector3d& voxel, const Vector3d& at) {
    Vector3d place;
    Matrix3d slope;
    return forward.At(at, place, slope) ? (place - voxel).norm() : NAN;
  });
}

TEST(PosingFidelity, TheInverseIsNewtonsInABentHinge) {
  const HingeWorld world;
  const DisplacementField bulge = world.Bulge(1.5);
  ResolvedPose pose = world.Posed(world.Bent(0.9));
  pose.coefficients = Eigen::MatrixXf::Constant(2, 1, 0.8f);
  const std::vector<double> errors = InverseErrors(world.Inputs({&bulge}), pose);
  ASSERT_GT(errors.size(), 3000u);
  EXPECT_LT(errors[errors.size() * 99 / 100], 0.12);
  EXPECT_LT(errors.back(), 1.0);
}

// Far from a cell its steps may land in it by chance: such voxels once came from places many voxels off.
TEST(PosingFidelity, NoVoxelComesFromAPlaceThatLandsElsewhereHoweverRoughTheTissueMoves) {
  const HingeWorld world;
  for (const float roughness_mm : {0.15f, 0.35f}) {
    std::mt19937 random(7);
    std::uniform_real_distribution<float> step(-roughness_mm, roughness_mm);
    DisplacementField rough(world.body.grid, Eigen::Vector3f::Zero());
    for (Eigen::Vector3f& d : rough.values) d = Eigen::Vector3f(step(random), step(random), step(random));
    ResolvedPose pose = world.Posed(world.Bent(0.8));
    pose.coefficients = Eigen::MatrixXf::Constant(2, 1, 1.0f);
    const std::vector<double> misses = Misses(world.Inputs({&rough}), pose);
    ASSERT_GT(misses.size(), 2000u);
    EXPECT_LT(misses.back(), 1.0) << roughness_mm;
  }
}

// Cells that bend too much for a few steps do not fold yet: they are inverted as they are, not as tetrahedra.
TEST(PosingFidelity, TheInverseIsNewtonsWhereTissueMovesRoughlyWithoutFolding) {
  const HingeWorld world;
  std::mt19937 random(11);
  std::uniform_real_distribution<float> step(-0.25f, 0.25f);
  DisplacementField rough(world.body.grid, Eigen::Vector3f::Zero());
  for (Eigen::Vector3f& d : rough.values) d = Eigen::Vector3f(step(random), step(random), step(random));
  for (size_t v = 0; v < rough.values.size(); ++v)
    if (world.bones.labels.values[v]) rough.values[v].setZero();  // as all examples are
  ResolvedPose pose = world.Posed(world.Bent(0.5));
  pose.coefficients = Eigen::MatrixXf::Constant(2, 1, 1.0f);
  const std::vector<double> errors = InverseErrors(world.Inputs({&rough}), pose);
  ASSERT_GT(errors.size(), 2000u);
  EXPECT_LT(errors[errors.size() * 99 / 100], 0.05);
}

// Two fingers side by side that touch over all their length in the scan, of bones that are no kin.
struct TouchingFingers {
  TouchingFingers() {
    grid.size = {32, 20, 40};
    scan.volume = Volume(grid, -50.0f);
    body = Mask(grid);
    weights = WeightMap(grid);
    bones.labels = LabelMap(grid);
    bones.bones = {{.label = 1, .name = "hand"},
                   {.label = 2, .name = "left palm", .parent = 0},
                   {.label = 3, .name = "right palm", .parent = 0},
                   {.label = 4, .name = "left", .parent = 1},
                   {.label = 5, .name = "right", .parent = 2}};
    for (size_t v = 0; v < body.values.size(); ++v) {
      const Vector3i n = grid.Ijk(v);
      weights.values[v] = {{uint8_t(n.x() < 16 ? 3 : 4), 0, 0, 0}, {1, 0, 0, 0}};
      const bool in_body = n.x() >= 8 && n.x() < 24 && n.y() >= 6 && n.y() < 14 && n.z() >= 6 && n.z() < 34;
      body.values[v] = in_body;
      if (in_body) scan.volume.values[v] = float(100 + n.x() + 2 * n.y() + n.z());
    }
  }
  PosingInputs Inputs() const { return {scan, body, bones, weights, {}}; }
  // The right finger moved aside by so many voxels (of 1 mm).
  ResolvedPose Apart(double voxels) const {
    ResolvedPose pose{PoseVector(5), Eigen::MatrixXf::Zero(5, 0), Eigen::VectorXd::Zero(5)};
    pose.scan_from_template[4].translation_mm = {voxels, 0, 0};
    return pose;
  }
  Grid grid;
  Scan scan;
  Mask body;
  BoneSet bones;
  WeightMap weights;
};

TEST(PosingFidelity, FingersThatTouchedDrawApartWithoutAWebAndKeepTheirSkin) {
  const TouchingFingers world;
  const PosingEngine engine(SharedBackend(), world.Inputs());
  const Volume posed = engine.Pose(world.Apart(5), world.grid).volume;
  for (int k = 8; k < 32; ++k) {
    for (int j = 8; j < 12; ++j) {
      for (int i = 9; i < 16; ++i)
        ASSERT_NEAR(posed(i, j, k), 100 + i + 2 * j + k, 0.05) << i;  // left, to its last voxel
      for (int i = 17; i < 20; ++i) ASSERT_EQ(posed(i, j, k), engine.air()) << i << " " << j << " " << k;
      for (int i = 21; i < 28; ++i) ASSERT_NEAR(posed(i, j, k), 95 + i + 2 * j + k, 0.05) << i;
    }
  }
}

TEST(PosingFidelity, FingersThatStayTogetherAreOneBody) {
  const TouchingFingers world;
  const PosingEngine engine(SharedBackend(), world.Inputs());
  for (const double apart : {0.0, 0.3}) {
    const Volume posed = engine.Pose(world.Apart(apart), world.grid).volume;
    for (int i = 9; i < 23; ++i) ASSERT_NEAR(posed(i, 10, 20), 140 + i, 0.4) << i << " at " << apart;
  }
}

TEST(PosingFidelity, TheInverseIsNewtonsWhereFingersTouchAndSlide) {
  const TouchingFingers world;
  ResolvedPose pose = world.Apart(0);
  pose.scan_from_template[4].translation_mm = {0.3, 0.2, 0.6};  // less than tears the skin between them
  const std::vector<double> errors = InverseErrors(world.Inputs(), pose);
  ASSERT_GT(errors.size(), 3000u);
  EXPECT_LT(errors[errors.size() * 99 / 100], 0.12);
  EXPECT_LT(errors.back(), 1.0);
}

// Each finger over the other's soft tissue: storage order puts one of them first.
TEST(PosingFidelity, BoneThatEntersSoftTissueIsShownWhole) {
  TouchingFingers world;
  const auto in_bone = [](int i, int j, int k) {
    return i >= 0 && i < 4 && j >= 9 && j < 12 && k >= 9 && k < 31;
  };
  for (size_t v = 0; v < world.body.values.size(); ++v) {
    const Vector3i n = world.grid.Ijk(v);
    if (in_bone(n.x() - 10, n.y(), n.z())) world.bones.labels.values[v] = 4;
    if (in_bone(n.x() - 18, n.y(), n.z())) world.bones.labels.values[v] = 5;
  }
  const PosingEngine engine(SharedBackend(), world.Inputs());
  for (const int moving : {3, 4}) {
    ResolvedPose pose = world.Apart(0);
    const int by = moving == 3 ? 4 : -4, first = (moving == 3 ? 10 : 18) + by;  // into 14..17
    pose.scan_from_template[size_t(moving)].translation_mm = {double(by), 0, 0};
    const LabelMap labels = engine.PoseLabels(pose, world.grid);
    const Volume posed = engine.Pose(pose, world.grid).volume;
    for (int k = 9; k < 31; ++k) {
      for (int j = 9; j < 12; ++j) {
        for (int i = first; i < first + 4; ++i) {
          ASSERT_EQ(labels(i, j, k), moving + 1) << i << " " << j << " " << k;
          ASSERT_NEAR(posed(i, j, k), 100 + i - by + 2 * j + k, 0.05) << i << " " << j << " " << k;
        }
      }
    }
  }
}

// Where the grid cuts the body off its voxels end half a voxel beyond their centres:
// a shift of less leaves no ragged end.
TEST(PosingFidelity, ACutEndKeepsItsLastLayerWhenItMovesInByLessThanHalfAVoxel) {
  TouchingFingers world;
  for (size_t v = 0; v < world.body.values.size(); ++v) {
    const Vector3i n = world.grid.Ijk(v);
    world.body.values[v] = n.x() >= 8 && n.x() < 24 && n.y() >= 6 && n.y() < 14 && n.z() < 34;
    if (world.body.values[v]) world.scan.volume.values[v] = float(100 + n.x());
  }
  const PosingEngine engine(SharedBackend(), world.Inputs());
  for (const double inwards : {0.3, 0.7}) {
    ResolvedPose pose = world.Apart(0);
    for (RigidTransform& bone : pose.scan_from_template) bone.translation_mm = {0, 0, inwards};
    const Volume posed = engine.Pose(pose, world.grid).volume;
    for (int i = 10; i < 22; ++i)
      ASSERT_NEAR(posed(i, 10, 0), inwards < 0.5 ? 100.0f + float(i) : engine.air(), 0.1)
          << i << " at " << inwards;
  }
}

struct BentHinge {
  BentHinge() { pose.coefficients = Eigen::MatrixXf::Constant(2, 1, 0.8f); }
  HingeWorld world;
  DisplacementField bulge = world.Bulge(1.5);
  PosingEngine engine{SharedBackend(), world.Inputs({&bulge})};
  ResolvedPose pose = world.Posed(world.Bent(0.9));
};

TEST(PosingFidelity, APlaneIsTheVolumesSlice) {
  const BentHinge bent;
  const Volume whole = bent.engine.Pose(bent.pose).volume;
  const int k = whole.grid.size.z() / 2;
  Grid plane = whole.grid;
  plane.size.z() = 1;
  plane.origin = whole.grid.ToMm(0, 0, k);
  const Volume slice = bent.engine.Pose(bent.pose, plane).volume;
  size_t unlike = 0, tissue = 0;
  for (int j = 0; j < plane.size.y(); ++j) {
    for (int i = 0; i < plane.size.x(); ++i) {
      tissue += whole(i, j, k) > 0;
      unlike += !(std::abs(slice(i, j, 0) - whole(i, j, k)) < 0.1);
    }
  }
  EXPECT_GT(tissue, 50u);
  EXPECT_LE(unlike, tissue / 100);
}

TEST(PosingFidelity, ARegionIsThatPartOfTheVolume) {
  const BentHinge bent;
  const Volume whole = bent.engine.Pose(bent.pose).volume;
  Grid region = whole.grid;
  const Vector3i first = whole.grid.size / 3;
  region.size = whole.grid.size / 3;
  region.origin = whole.grid.ToMm(PointVox{first.cast<double>()});
  const Volume part = bent.engine.Pose(bent.pose, region).volume;
  size_t unlike = 0;
  for (size_t v = 0; v < part.values.size(); ++v) {
    const Vector3i n = first + region.Ijk(v);
    unlike += !(std::abs(part.values[v] - whole(n.x(), n.y(), n.z())) < 0.1);
  }
  EXPECT_LE(unlike, part.values.size() / 200);
}

TEST(PosingFidelity, ALevelIsTheMeanOfTheVoxelsItCovers) {
  const BentHinge bent;
  const Volume whole = bent.engine.Pose(bent.pose).volume, half = bent.engine.Pose(bent.pose, {}, 1).volume;
  ASSERT_TRUE(half.grid == Coarsened(whole.grid, 2));
  for (size_t v = 0; v < half.values.size(); ++v) {
    const Vector3i low = 2 * half.grid.Ijk(v);
    double mean = 0;
    for (int n = 0; n < 8; ++n) {
      const Vector3i at =
          (low + Vector3i(n & 1, (n >> 1) & 1, n >> 2)).cwiseMin(whole.grid.size - Vector3i::Ones());
      mean += whole(at.x(), at.y(), at.z()) / 8;
    }
    ASSERT_NEAR(half.values[v], mean, 1e-3);
  }
}

TEST(PosingFidelity, CubicSamplingIsExactAtVoxelsAndCloserBetweenThem) {
  const BentHinge bent;
  const ResolvedPose still = bent.world.Posed(bent.world.Bent(0));
  const Volume same = bent.engine.Pose(still, {}, 0, Sampling::kCubic).volume;
  for (size_t v = 0; v < same.values.size(); ++v)
    ASSERT_NEAR(same.values[v], bent.world.scan.volume.values[v], 0.05);
  RigidTransform aside;
  aside.translation_mm = 0.5 * bent.world.body.grid.MmFromVox() * Vector3d::Ones();
  const ResolvedPose moved = bent.world.Posed({aside, aside});
  double error[2] = {0, 0};
  for (const int cubic : {0, 1}) {
    const Volume posed =
        bent.engine.Pose(moved, bent.world.body.grid, 0, cubic ? Sampling::kCubic : Sampling::kLinear).volume;
    for (size_t v = 0; v < posed.values.size(); ++v) {
      const PointMm x = aside.Inverse() * posed.grid.ToMm(PointVox{posed.grid.Ijk(v).cast<double>()});
      if (bent.world.DeepInside(x, 4)) error[cubic] += std::abs(posed.values[v] - bent.world.TextureAt(x));
    }
  }
  EXPECT_LT(error[1], 0.5 * error[0]);
}

TEST(PosingFidelity, ManyPosesTakeNoMoreMemoryAndDoNotDependOnEachOther) {
  const BentHinge bent;
  std::vector<ResolvedPose> poses;
  for (const double angle : {0.1, 0.5, 0.9, 1.4}) poses.push_back(bent.world.Posed(bent.world.Bent(angle)));
  std::vector<Volume> alone;
  for (const ResolvedPose& pose : poses) alone.push_back(bent.engine.Pose(pose).volume);
  PosedVolume out;
  bent.engine.PoseInto(out, poses[3], bent.world.body.grid, 1);
  const int64_t before = bent.engine.allocations();
  for (int n = 0; n < 40; ++n) {
    bent.engine.PoseInto(out, poses[3], bent.world.body.grid, n % 3);
    bent.engine.PoseInto(out, poses[size_t(n) % 4]);
    ASSERT_EQ(out.volume.values, alone[size_t(n) % 4].values) << n;
  }
  EXPECT_EQ(bent.engine.allocations(), before);
}

}  // namespace
}  // namespace kvx
