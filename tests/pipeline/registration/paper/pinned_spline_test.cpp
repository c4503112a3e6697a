// The block spline with fixed points: exact at its nodes, and the plain spline without them.
#include "pipeline/registration/paper/pinned_spline.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

constexpr std::array<bool, kControlPoints> kNone{};

TEST(PinnedSpline, WithoutBoneIsTheBlockSpline) {
  const PinnedSpline pinned(kNone, {});
  const BlockSpline plain;
  for (const Eigen::Vector3d& p : {Eigen::Vector3d(0, 0, 0), Eigen::Vector3d(0.3, -0.2, 0.6)}) {
    EXPECT_LT((pinned.Basis(p) - Eigen::RowVectorXd(plain.Basis(p))).norm(), 1e-12);
  }
}

TEST(PinnedSpline, IsOneAtItsOwnPointAndZeroAtAllOthers) {
  std::array<bool, kControlPoints> in_bone{};
  in_bone[2] = true;
  const PinnedSpline spline(in_bone, {{0, 0, 0.6}, {0.5, 0.4, -0.4}, {0, 0.8, 0}});
  ASSERT_EQ(spline.free_count(), 7);
  ASSERT_EQ(spline.nodes().size(), 11u);
  for (size_t n = 0; n < spline.nodes().size(); ++n) {
    const Eigen::RowVectorXd row = spline.Basis(spline.nodes()[n]);
    for (Eigen::Index a = 0; a < row.size(); ++a) EXPECT_NEAR(row[a], size_t(a) == n, 1e-9);
  }
}

TEST(PinnedSpline, TakesNoMoreThanTwelveFixedPointsAndNoneOnTopOfAnother) {
  std::vector<Eigen::Vector3d> many;
  for (int n = 0; n < 40; ++n) many.push_back({0.02 * n - 0.4, 0.5 * std::sin(n), 0.5 * std::cos(2 * n)});
  many.push_back(BlockSpline().control_points()[0]);
  const PinnedSpline spline(kNone, many);
  EXPECT_EQ(spline.nodes().size(), size_t(spline.free_count() + PinnedSpline::kMostFixed));
  for (size_t a = 0; a < spline.nodes().size(); ++a) {
    for (size_t b = 0; b < a; ++b) {
      EXPECT_GE((spline.nodes()[a] - spline.nodes()[b]).norm(), PinnedSpline::kLeastGap);
    }
  }
}

TEST(PinnedSpline, AllOfItInBoneHasNothingToMove) {
  std::array<bool, kControlPoints> all;
  all.fill(true);
  EXPECT_EQ(PinnedSpline(all, {}).free_count(), 0);
}

}  // namespace
}  // namespace kvx
