// Pictures of volumes by the real program.
#include "pipeline/io/volume_file.h"
#include "tests/support/program_test.h"

namespace kvx {
namespace {
using namespace testing_support;

using Slices = ProgramTest;

// Muscle and fat up to a round view's edge.
TEST_F(Slices, FillingIsNoGreyOfThePicture) {
  for (const float filling : {-1024.0f, -3024.0f}) {
    Volume ct(ObliqueGrid({30, 30, 12}));
    for (size_t v = 0; v < ct.values.size(); ++v) {
      const Eigen::Vector3i p = ct.grid.Ijk(v);
      ct.values[v] = std::hypot(p.x() - 14.5, p.y() - 14.5) > 14 ? filling : v % 3 ? 40.0f : -80.0f;
    }
    const std::string name = "ct" + std::to_string(int(filling));
    WriteVolume(At(name + ".nii.gz"), ct, ScalarType::kInt16);
    const Ended ended = Run({"slices", At(name + ".nii.gz"), "--out", At(name + ".png")});
    ASSERT_EQ(ended.code, 0) << ended.err;
  }
  EXPECT_EQ(Content(At("ct-3024.png")), Content(At("ct-1024.png")));
}

}  // namespace
}  // namespace kvx
