// Algorithm 1's order, limits and determinism, and the way back to the template.
#include "pipeline/registration/paper/register_as_published.h"

#include <gtest/gtest.h>

#include "pipeline/registration/paper/paper_stage.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

// A textured slab whose target is moved at both ends, more at the first, and perhaps in waves.
PaperPair SlabPair(const Eigen::Vector3i& size = {48, 24, 24}, double waves = 0) {
  Grid grid;
  grid.size = size;
  PaperPair pair{Volume(grid), Volume(grid), Mask(grid, 1), Mask(grid)};
  const auto texture = [](const Eigen::Vector3d& p) {
    return 128 + 90 * std::sin(0.5 * p.x() + 0.2 * p.y()) * std::cos(0.4 * p.y() - 0.3 * p.z()) +
           30 * std::sin(0.5 * p.z());
  };
  for (size_t v = 0; v < pair.source.values.size(); ++v) {
    const Eigen::Vector3d p = grid.Ijk(v).cast<double>();
    const auto bump = [&](double x) {
      return std::exp(-(p - Eigen::Vector3d(x, 12, 12)).squaredNorm() / 60);
    };
    pair.source.values[v] = float(texture(p));
    pair.target.values[v] = float(texture(
        p + (2.5 * bump(8) + 1.8 * bump(40) + waves * std::sin(0.5 * p.x())) * Eigen::Vector3d::UnitX()));
  }
  return pair;
}

TEST(RegisterAsPublished, TheWorstBlockGoesFirstAndALimitEndsIt) {
  std::vector<std::string> said;
  const Progress progress(
      [&](std::string_view stage, double fraction) {
        said.emplace_back(stage);
        EXPECT_GE(fraction, 0);
        EXPECT_LE(fraction, 1);
      },
      {});
  const PaperRegistration one = RegisterAsPublished(SlabPair(), {.max_blocks = 1}, SharedBackend(), progress);
  int64_t points = 0;
  for (const int64_t n : one.control_points_per_level) points += n;
  EXPECT_EQ(points, kControlPoints);
  ASSERT_FALSE(said.empty());
  EXPECT_NE(said.back().find("1 of about 1 blocks"), std::string::npos) << said.back();
  EXPECT_GT(one.shifts(8, 12, 12).norm(), 0.2f) << "where the mismatch is";
  EXPECT_EQ(one.shifts(44, 12, 12), Eigen::Vector3f::Zero()) << "where there is none";
}

// From the first block on, whatever its level: of finer levels what waits there is counted.
TEST(RegisterAsPublished, SaysHowManyBlocksThereWillBe) {
  std::vector<std::string> said;
  const Progress progress([&](std::string_view stage, double) { said.emplace_back(stage); }, {});
  const PaperRegistration all = RegisterAsPublished(SlabPair({32, 16, 16}, 2), {}, SharedBackend(), progress);
  int64_t points = 0;
  for (const int64_t n : all.control_points_per_level) points += n;
  const double blocks = double(points) / kControlPoints;
  ASSERT_GT(blocks, 5);
  const std::string first = said.front();
  const double foreseen = std::stod(first.substr(first.find("about ") + 6));
  EXPECT_GE(foreseen, 0.6 * blocks) << first;
  EXPECT_LE(foreseen, 2.5 * blocks) << first;
}

TEST(RegisterAsPublished, TheSameSeedGivesTheSameField) {
  const auto run = [](int64_t seed) {
    return RegisterAsPublished(SlabPair(), {.seed = seed, .max_blocks = 1}, SharedBackend(), {})
        .shifts.values;
  };
  EXPECT_EQ(run(3), run(3));
}

TEST(RegisterAsPublished, ImagesThatAgreeNeedNoBlock) {
  PaperPair pair = SlabPair();
  pair.target = pair.source;
  const PaperRegistration none = RegisterAsPublished(pair, {}, SharedBackend(), {});
  const size_t levels =
      RegisterAsPublished(SlabPair(), {.max_blocks = 1}, SharedBackend(), {}).control_points_per_level.size();
  EXPECT_GT(levels, 0u);
  EXPECT_EQ(none.control_points_per_level, std::vector<int64_t>(levels, 0));
  for (const Eigen::Vector3f& shift : none.shifts.values) ASSERT_EQ(shift, Eigen::Vector3f::Zero());
}

TEST(RegisterAsPublished, LimitsBelowZeroAreRefused) {
  EXPECT_THROW(RegisterAsPublished(SlabPair(), {.max_blocks = -1}, SharedBackend(), {}), InputError);
  EXPECT_THROW(RegisterAsPublished(SlabPair(), {.max_seconds = -1}, SharedBackend(), {}), InputError);
}

TEST(ThroughShifts, ASmoothShiftIsInvertedWhereTheInitialMapLands) {
  const Grid scan = ObliqueGrid({20, 20, 20});
  VoxelShifts shifts(scan, Eigen::Vector3f::Zero());
  for (size_t v = 0; v < shifts.values.size(); ++v) {
    const Eigen::Vector3d p = scan.Ijk(v).cast<double>();
    shifts.values[v] =
        Eigen::Vector3f(float(0.8 * std::sin(0.2 * p.y())), float(0.5 * std::cos(0.25 * p.x())), -0.6f);
  }
  const RigidTransform scan_from_template{
      Eigen::Quaterniond(Eigen::AngleAxisd(0.1, Eigen::Vector3d(1, 2, 3).normalized())), {1, -2, 0.5}};
  const Grid grid = ObliqueGrid({9, 8, 7});
  const DisplacementField initial = FieldOf(scan_from_template, grid);
  const DisplacementField found = ThroughShifts(initial, shifts);
  for (size_t v = 0; v < found.values.size(); ++v) {
    const Eigen::Vector3i at = grid.Ijk(v);
    const Eigen::Vector3d x = grid.ToMm(at.x(), at.y(), at.z()).lps;
    const PointVox p = scan.ToVox(PointMm{x + found.values[v].cast<double>()});
    const PointVox y = scan.ToVox(PointMm{x + initial.values[v].cast<double>()});
    EXPECT_LT((p.ijk + SampleTrilinear(shifts, p) - y.ijk).norm(), 5e-3);
  }
}

}  // namespace
}  // namespace kvx
