// What registration must not depend on: where the world's axes point, how scans are stored, which voxels show
// them, which of two volumes is the template.
#include <gtest/gtest.h>

#include <random>

#include "core/voxels/moved_grid.h"
#include "pipeline/registration/register_volumes.h"
#include "pipeline/registration/result/inverse_map.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

constexpr double kSpacing = 1.8, kRadius = 22;
const Eigen::Vector3d kCentre(30, 30, 30);

Grid BallGrid() {
  Grid grid;
  grid.size = {34, 34, 34};
  grid.spacing_mm = Eigen::Vector3d::Constant(kSpacing);
  return grid;
}

double Intensity(const Eigen::Vector3d& x) {
  const double edge = 1 / (1 + std::exp(((x - kCentre).norm() - kRadius) / 0.8));
  return edge * (100 + 20 * std::sin(0.35 * x.x() + 0.2 * x.y()) * std::cos(0.3 * x.y() - 0.15 * x.z()) +
                 20 * std::sin(0.4 * x.z() + 0.25 * x.x()));
}

// Pushes the middle aside by up to 3.4 mm.
Eigen::Vector3d Push(const Eigen::Vector3d& x) {
  return Eigen::Vector3d(2.4, -1.8, 1.6) * std::exp(-(x - kCentre).squaredNorm() / (2 * 11 * 11));
}

Scan Render(bool pushed, unsigned seed, const Grid& grid = BallGrid()) {
  Scan scan;
  scan.volume = Volume(grid);
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0, 3);
  for (size_t v = 0; v < scan.volume.values.size(); ++v) {
    Eigen::Vector3d x = scan.volume.grid.ToMm(PointVox{scan.volume.grid.Ijk(v).cast<double>()}).lps;
    const Eigen::Vector3d seen = x;
    for (int n = 0; pushed && n < 30; ++n) x = seen - Push(x);
    scan.volume.values[v] = float(Intensity(x) + noise(random));
  }
  return scan;
}

RegisteredScan Register(const Scan& fixed, const Scan& moving) {
  StageContext context{SharedBackend(), {}};
  return RegisterVolumes(fixed, moving, {}, {}, context);
}

Scan Turned(Scan scan, const RigidTransform& turn) {
  scan.volume.grid = Moved(turn, scan.volume.grid);
  return scan;
}

// The same voxels in another order: x from right to left, then y and z exchanged.
Grid StoredOtherwise(const Grid& grid) {
  Grid stored = grid;
  stored.size = {grid.size.x(), grid.size.z(), grid.size.y()};
  stored.spacing_mm = {grid.spacing_mm.x(), grid.spacing_mm.z(), grid.spacing_mm.y()};
  stored.origin = grid.ToMm(grid.size.x() - 1, 0, 0);
  stored.direction.col(0) = -grid.direction.col(0);
  stored.direction.col(1) = grid.direction.col(2);
  stored.direction.col(2) = grid.direction.col(1);
  return stored;
}
Scan StoredOtherwise(const Scan& scan) {
  const Grid& grid = scan.volume.grid;
  Scan out = scan;
  Grid& stored = out.volume.grid;
  stored = StoredOtherwise(grid);
  for (size_t v = 0; v < scan.volume.values.size(); ++v) {
    const Eigen::Vector3i p = grid.Ijk(v);
    out.volume.values[stored.Index(grid.size.x() - 1 - p.x(), p.z(), p.y())] = scan.volume.values[v];
  }
  return out;
}

// Mean distance over the ball between two fields on the same voxels, the second turned back.
double Between(const RegisteredScan& a, const RegisteredScan& b, const Eigen::Matrix3d& b_axes) {
  double sum = 0, count = 0;
  const Grid grid = BallGrid();
  for (size_t v = 0; v < grid.VoxelCount(); ++v) {
    if ((grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps - kCentre).norm() > kRadius) continue;
    const Eigen::Vector3d back = b_axes.transpose() * b.scan_from_template.values[v].cast<double>();
    sum += (a.scan_from_template.values[v].cast<double>() - back).norm();
    count += 1;
  }
  return sum / count;
}

// Rounding decides now and then whether a step is taken.
constexpr double kRoundingVoxels = 0.02;

TEST(Registration, DoesNotSeeWhereTheWorldsAxesPoint) {
  const Scan fixed = Render(false, 1), moving = Render(true, 2);
  RigidTransform turn;
  turn.rotation = Eigen::AngleAxisd(0.9, Eigen::Vector3d(2, -1, 3).normalized());
  turn.translation_mm = {40, -70, 15};
  const RegisteredScan as_it_is = Register(fixed, moving),
                       turned = Register(Turned(fixed, turn), Turned(moving, turn));
  EXPECT_LT(Between(as_it_is, turned, turn.rotation.toRotationMatrix()), kRoundingVoxels * kSpacing);
}

TEST(Registration, DoesNotSeeHowTheScanIsStored) {
  const Scan fixed = Render(false, 1), moving = Render(true, 2);
  EXPECT_LT(
      Between(Register(fixed, moving), Register(fixed, StoredOtherwise(moving)), Eigen::Matrix3d::Identity()),
      kRoundingVoxels * kSpacing);
}

struct Voxels {
  const char* name;
  Grid grid;
};

// All hold the ball.
std::vector<Voxels> OtherVoxels() {
  Grid shifted = BallGrid(), longer = BallGrid(), finer = BallGrid(), coarser = BallGrid(),
       askew = BallGrid();
  shifted.origin.lps += kSpacing * Eigen::Vector3d(0.5, -0.37, 0.21);
  longer.spacing_mm = {1.6, 2.0, 1.7}, longer.size = {38, 31, 36};
  finer.spacing_mm.setConstant(1.35), finer.size.setConstant(45);
  coarser.spacing_mm.setConstant(2.3), coarser.size.setConstant(27);
  askew.size.setConstant(38);
  askew.direction = Eigen::AngleAxisd(0.5, Eigen::Vector3d(1, 2, -1).normalized()).toRotationMatrix();
  askew.origin.lps += kCentre - askew.Middle().lps;
  return {{"shifted", shifted}, {"longer one way", longer},
          {"finer", finer},     {"coarser", coarser},
          {"askew", askew},     {"in another order", StoredOtherwise(BallGrid())}};
}

struct Apart {
  double mean_mm, common_mm;  // of distances; of the vectors themselves
};

// Over the ball, whatever voxels the fields are on.
Apart ApartInTheBall(const DisplacementField& a, const DisplacementField& b) {
  double sum = 0, count = 0;
  Eigen::Vector3d common = Eigen::Vector3d::Zero();
  const Grid grid = BallGrid();
  for (size_t v = 0; v < grid.VoxelCount(); ++v) {
    const PointMm x = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()});
    if ((x.lps - kCentre).norm() > kRadius) continue;
    const Eigen::Vector3d apart = SampleTrilinear(b, b.grid.ToVox(x)) - SampleTrilinear(a, a.grid.ToVox(x));
    sum += apart.norm(), common += apart, count += 1;
  }
  return {sum / count, common.norm() / count};
}

// Each result is off by 0.17 voxels in the mean, and with other noise on the same voxels they are 0.07 apart:
// other voxels have other noise, and blocks elsewhere, but must not be as far apart as they are from the
// truth. Nor may all of it be shifted: a corner taken for a voxel's middle would be half a voxel.
TEST(Registration, DoesNotSeeWhichVoxelsShowTheTemplateOrBoth) {
  const RegisteredScan as_it_is = Register(Render(false, 1), Render(true, 2));
  for (const auto& [name, grid] : OtherVoxels()) {
    const Scan fixed = Render(false, 3, grid);
    for (const Scan& moving : {Render(true, 2), Render(true, 4, grid)}) {
      const Apart apart =
          ApartInTheBall(as_it_is.scan_from_template, Register(fixed, moving).scan_from_template);
      EXPECT_LT(apart.mean_mm, 0.15 * kSpacing) << name << ", both " << (moving.volume.grid == grid);
      EXPECT_LT(apart.common_mm, 0.05 * kSpacing) << name << ", both " << (moving.volume.grid == grid);
    }
  }
}

TEST(Registration, ThereAndBackIsWhereItBegan) {
  const Scan a = Render(false, 1), b = Render(true, 2);
  const RegisteredScan there = Register(a, b), back = Register(b, a);
  double off = 0, moved = 0, count = 0;
  const Grid grid = BallGrid();
  for (size_t v = 0; v < grid.VoxelCount(); ++v) {
    const Eigen::Vector3d x = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps;
    if (Push(x).norm() < 0.7 * kSpacing) continue;
    const Eigen::Vector3d u = there.scan_from_template.values[v].cast<double>();
    const Eigen::Vector3d end = x + u + SampleTrilinear(back.scan_from_template, grid.ToVox(PointMm{x + u}));
    off += (end - x).norm(), moved += u.norm(), count += 1;
  }
  ASSERT_GT(count, 500);
  EXPECT_GT(moved / count, 0.7 * kSpacing);
  EXPECT_LT(off / count, 0.2 * kSpacing);
}

BoneSet NoBones(const Grid& grid) {
  BoneSet none;
  none.labels = LabelMap(grid);
  return none;
}

// A planted field in closed form.
TEST(InverseMap, BringsPointsBackAndKnowsWhatItDoesNotKnow) {
  const Grid grid = BallGrid();
  Mask body(grid);
  DisplacementField field(grid);
  for (size_t v = 0; v < grid.VoxelCount(); ++v) {
    const Eigen::Vector3d x = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps;
    body.values[v] = (x - kCentre).norm() < kRadius;
    field.values[v] = (Push(x) + Eigen::Vector3d(4, 0, 0)).cast<float>();
  }
  Grid scan = ObliqueGrid({40, 42, 44});
  scan.spacing_mm = {1.5, 1.6, 1.7};
  scan.origin.lps += kCentre - scan.ToMm(20, 21, 22).lps;
  const BoneSet no_bones = NoBones(grid);
  const BorderedField carried(field, no_bones, {});
  const InverseMap template_from_scan(carried, body, scan);
  for (const Eigen::Vector3d& x :
       {Eigen::Vector3d(30, 30, 30), Eigen::Vector3d(36.3, 25.1, 33.8), Eigen::Vector3d(20.2, 31, 24)}) {
    const auto found = template_from_scan({x + SampleTrilinear(field, grid.ToVox(PointMm{x}))});
    ASSERT_TRUE(found.has_value());
    EXPECT_LT((found->lps - x).norm(), 0.01);
  }
  EXPECT_FALSE(template_from_scan({kCentre + Eigen::Vector3d(-26, 0, 0)}).has_value());
  EXPECT_FALSE(template_from_scan({kCentre + Eigen::Vector3d(400, 0, 0)}).has_value());
  const DisplacementField whole = InverseField(carried, body, scan);
  const Eigen::Vector3d y = scan.ToMm(20, 21, 22).lps;
  EXPECT_LT((whole(20, 21, 22).cast<double>() + y - template_from_scan({y})->lps).norm(), 1e-4);
  EXPECT_TRUE(std::isnan(whole.values[0].x()));
}

// Beside the body its nearest voxels are told of as well, and lead on to places that are not in it.
TEST(InverseMap, OfAirBesideTheBodyNothingIsKnown) {
  const Grid grid = ObliqueGrid({12, 12, 12});
  Mask body(grid);
  for (size_t v = 0; v < grid.VoxelCount(); ++v) body.values[v] = grid.Ijk(v).x() < 6;
  const DisplacementField still(grid, Eigen::Vector3f::Zero());
  const BoneSet no_bones = NoBones(grid);
  const DisplacementField back = InverseField(BorderedField(still, no_bones, {}), body, grid);
  for (size_t v = 0; v < grid.VoxelCount(); ++v)
    ASSERT_EQ(std::isfinite(back.values[v].x()), body.values[v] != 0) << grid.Ijk(v).transpose();
}

// Between thick slices of the template there are many voxels of the scan.
TEST(InverseMap, FindsWhatLiesBetweenThickSlices) {
  Grid thick, fine;
  thick.size = {12, 12, 5}, thick.spacing_mm = {2, 2, 9};
  fine.size = {22, 22, 60}, fine.spacing_mm = {1, 1, 0.6};
  const Mask body(thick, 1);
  const DisplacementField still(thick, Eigen::Vector3f::Zero());
  const BoneSet no_bones = NoBones(thick);
  const BorderedField carried(still, no_bones, {});
  const InverseMap template_from_scan(carried, body, fine);
  for (double z = 0; z < 35; z += 0.7) {
    const auto found = template_from_scan({{10.3, 11.1, z}});
    ASSERT_TRUE(found.has_value()) << z;
    EXPECT_LT((found->lps - Eigen::Vector3d(10.3, 11.1, z)).norm(), 0.01);
  }
}

}  // namespace
}  // namespace kvx
