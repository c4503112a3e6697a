// A millionth of a GB a frame and byte.
#include "server/ports/animation_limits.h"

#include <gtest/gtest.h>

#include "core/errors.h"

namespace kvx {
namespace {

TEST(AnimationLimits, CountTheBytesOfWhatIsWritten) {
  Grid grid;
  grid.size = {100, 100, 100};
  EXPECT_NO_THROW(RequireFewBytes(grid, 0, ScalarType::kFloat32, 1000));
  EXPECT_THROW(RequireFewBytes(grid, 0, ScalarType::kFloat32, 1001), InputError);
  EXPECT_NO_THROW(RequireFewBytes(grid, 0, ScalarType::kInt16, 2000));
  EXPECT_THROW(RequireFewBytes(grid, 0, ScalarType::kInt16, 2001), InputError);
  EXPECT_NO_THROW(RequireFewBytes(grid, 1, ScalarType::kFloat32, 2000));
}

}  // namespace
}  // namespace kvx
