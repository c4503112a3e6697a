// Pictures of volumes by the real program.
#include <nlohmann/json.hpp>

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
    EXPECT_EQ(ended.out, "");
  }
  EXPECT_EQ(Content(At("ct-3024.png")), Content(At("ct-1024.png")));
}

TEST_F(Slices, SayHowLargeThePictureIs) {
  Volume ct(ObliqueGrid({30, 30, 12}));
  for (size_t v = 0; v < ct.values.size(); ++v) ct.values[v] = float(v % 97);
  WriteVolume(At("a.nii.gz"), ct, ScalarType::kInt16);
  const nlohmann::json told = RunJson({"slices", At("a.nii.gz"), At("a.nii.gz"), "--out", At("two.png")});
  EXPECT_EQ(told["volumes"], 2);
  const std::string png = Content(At("two.png"));  // width and height: bytes 16 to 23, the greatest first
  const auto number = [&](size_t at) {
    int value = 0;
    for (size_t n = at; n < at + 4; ++n) value = 256 * value + uint8_t(png[n]);
    return value;
  };
  EXPECT_EQ(told["width"], number(16));
  EXPECT_EQ(told["height"], number(20));
}

}  // namespace
}  // namespace kvx
