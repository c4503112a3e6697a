// The simplex on a function whose minimum is known.
#include "pipeline/registration/paper/simplex.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

// Least at (1, -2, 0.5), where it is 3.
double Bowl(std::span<const double> x) {
  return 3 + (x[0] - 1) * (x[0] - 1) + 4 * (x[1] + 2) * (x[1] + 2) + (x[2] - 0.5) * (x[2] - 0.5);
}

TEST(Simplex, FindsTheMinimumOfABowl) {
  const SimplexResult found = MinimiseBySimplex(
      Bowl, {0, 0, 0}, {.bound = 5, .first_step = 0.5, .least_step = 1e-6, .least_gain = 0});
  EXPECT_NEAR(found.value, 3, 1e-6);
  EXPECT_NEAR(found.at[0], 1, 1e-3);
  EXPECT_NEAR(found.at[1], -2, 1e-3);
  EXPECT_NEAR(found.at[2], 0.5, 1e-3);
}

TEST(Simplex, StaysInTheBoxAndWithinItsBudget) {
  int calls = 0;
  const auto counted = [&](std::span<const double> x) {
    ++calls;
    for (const double value : x) EXPECT_LE(std::abs(value), 1.0);
    return Bowl(x);
  };
  const SimplexResult found =
      MinimiseBySimplex(counted, {0, 0, 0}, {.bound = 1, .first_step = 0.5, .most_evaluations = 60});
  EXPECT_LE(calls, 60);
  EXPECT_EQ(found.evaluations, calls);
  EXPECT_LT(found.value, Bowl(std::vector<double>{0, 0, 0}));
}

TEST(Simplex, IsNeverWorseThanItsStart) {
  const std::vector<double> best{1, -2, 0.5};
  EXPECT_LE(MinimiseBySimplex(Bowl, best, {.bound = 5, .most_evaluations = 5}).value, Bowl(best));
}

}  // namespace
}  // namespace kvx
