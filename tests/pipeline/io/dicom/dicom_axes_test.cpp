// Axes of a series whose header rounds its direction cosines, against those that it was made of.
#include "pipeline/io/dicom/dicom_axes.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/errors.h"
#include "pipeline/io/volume_file.h"
#include "tests/support/dicom_bytes.h"
#include "tests/support/fixtures.h"
#include "tests/support/refusal.h"

namespace kvx {
namespace {
using namespace testing_support;
using testing::HasSubstr;

Eigen::Matrix3d Oblique() {
  return (Eigen::AngleAxisd(0.41, Eigen::Vector3d::UnitX()) *
          Eigen::AngleAxisd(-0.23, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(0.67, Eigen::Vector3d::UnitZ()))
      .toRotationMatrix();
}

std::string Decimals(const Eigen::Vector3d& v, int digits) {
  std::string text;
  for (const double component : v) {
    char number[32];
    std::snprintf(number, sizeof number, "%.*f", digits, component);
    text += (text.empty() ? "" : "\\") + std::string(number);
  }
  return text;
}

// A hundred slices 2 mm apart: a normal that is 0.005 off would lead them 1 mm aside.
void WriteSeries(const std::filesystem::path& folder, const Eigen::Matrix3d& axes, int digits,
                 const Eigen::Vector3d& step_mm) {
  for (int n = 0; n < 100; ++n) {
    WriteCtSlice(folder / (std::to_string(n) + ".dcm"),
                 {.slice = n,
                  .position = Decimals(n * step_mm, 4),
                  .axes = Decimals(axes.col(0), digits) + "\\" + Decimals(axes.col(1), digits)});
  }
}

TEST(DicomAxes, RoundedCosinesAreMadeGoodByThePositions) {
  for (const int digits : {2, 3, 4, 9}) {
    const ScratchFolder folder;
    WriteSeries(folder.path(), Oblique(), digits, 2 * Oblique().col(2));
    const Grid grid = ReadVolumeInfo(folder.path()).grid;
    EXPECT_NEAR(grid.spacing_mm.z(), 2, 1e-5) << digits;
    EXPECT_LT((grid.direction.col(2) - Oblique().col(2)).norm(), 1e-5) << digits;
    EXPECT_LT((grid.direction - Oblique()).cwiseAbs().maxCoeff(), 1.7 * std::pow(10, -digits)) << digits;
    EXPECT_TRUE((grid.direction.transpose() * grid.direction).isIdentity(1e-12)) << digits;
  }
}

// Two degrees are not rounding, and cosines that are whole numbers, or have many digits, are meant so.
TEST(DicomAxes, ATiltIsNoRounding) {
  const auto complaint = [](const Eigen::Matrix3d& axes, int digits, double tilt) {
    const ScratchFolder folder;
    WriteSeries(folder.path(), axes, digits, 2 * axes.col(2) + 2 * tilt * axes.col(1));
    return RefusalOf<InputError>([&] { ReadVolumeInfo(folder.path()); }, "none");
  };
  EXPECT_EQ(complaint(Oblique(), 2, 0), "none");
  EXPECT_THAT(complaint(Oblique(), 2, 0.035), HasSubstr("gantry tilt"));
  EXPECT_THAT(complaint(Oblique(), 9, 0.003), HasSubstr("gantry tilt"));
  EXPECT_THAT(complaint(Eigen::Matrix3d::Identity(), 2, 0.003), HasSubstr("gantry tilt"));
}

TEST(DicomAxes, AxesThatAreNotAtRightAnglesAreRefused) {
  const DicomFrame skew{{0, 0, 0}, {1, 0, 0}, {0.05, 0.99, 0}, {1, 1}};
  EXPECT_THAT(RefusalOf<InputError>([&] { AxesOf(skew, {0, 0, 1}); }, "none"), HasSubstr("right angles"));
}

}  // namespace
}  // namespace kvx
