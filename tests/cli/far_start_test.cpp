// Registration from far off, without bones that would say where: the paper's Table 2.
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <fstream>

#include "pipeline/io/npz_file.h"
#include "tests/support/program_test.h"

namespace kvx {
namespace {

using testing_support::HasSharedData;
using testing_support::SharedData;

class FarStart : public testing_support::ProgramTest {
 protected:
  void ExpectBelow(double most_mm, const std::filesystem::path& phantom);

  // A study whose only bone is the one that does not move.
  std::string Study(const std::filesystem::path& phantom, const std::string& bent) {
    const auto file = [&](const std::string& name) { return (phantom / (name + ".nii.gz")).string(); };
    const nlohmann::json study{
        {"name", "bend"},
        {"region", "custom"},
        {"template", "pose00"},
        {"scans",
         {{{"name", "pose00"}, {"volume", file("pose00")}}, {{"name", bent}, {"volume", file(bent)}}}},
        {"bones",
         {{"labels", file("bones_template")},
          {"list", {{{"label", 1}, {"name", "femur"}, {"parent", nullptr}}}}}}};
    std::ofstream(At("study.json")) << study;
    return At("study.json");
  }
};

// Over the phantom's points, of the scan bent mechanically.
void FarStart::ExpectBelow(double most_mm, const std::filesystem::path& phantom) {
  const testing_support::Ended built =
      Run({"build", Study(phantom, "bend10_mech"), "--out", At("m"), "--quiet"});
  ASSERT_EQ(built.code, 0) << built.err;
  const NpyArrays truth = ReadNpz(phantom / "truth/bend10_mech_points.npz");
  const std::vector<double> from = AsDoubles(ArrayNamed(truth, "template")),
                            to = AsDoubles(ArrayNamed(truth, "position")),
                            shown = AsDoubles(ArrayNamed(truth, "in_fov"));
  std::ofstream points(At("in.csv"));
  points << "x,y,z\n";
  for (size_t p = 0; p < shown.size(); ++p)  // RAS
    points << -from[3 * p] << "," << -from[3 * p + 1] << "," << from[3 * p + 2] << "\n";
  points.close();
  const testing_support::Ended mapped =
      Run({"map-points", At("m"), "--scan", "bend10_mech", "--points", At("in.csv"), "--out", At("out.csv")});
  ASSERT_EQ(mapped.code, 0) << mapped.err;
  std::ifstream answer(At("out.csv"));
  std::string line;
  std::getline(answer, line);
  double sum = 0, count = 0;
  for (size_t p = 0; p < shown.size() && std::getline(answer, line); ++p) {
    double x, y, z;
    if (shown[p] == 0 || std::sscanf(line.c_str(), "%lf,%lf,%lf", &x, &y, &z) != 3) continue;
    sum += std::hypot(x + to[3 * p], y + to[3 * p + 1], z - to[3 * p + 2]), ++count;
  }
  EXPECT_GT(count, 19000);
  EXPECT_LT(sum / count, most_mm);
}

// 24 mm at the end of the leg. The issue asks for 0.45 mm; wide blocks on the coarsest of three levels left
// 0.38.
TEST_F(FarStart, ABendOfTenDegreesIsFoundFromNothing) {
  if (!HasSharedData()) GTEST_SKIP() << "../shared is not beside the repository";
  ExpectBelow(0.2, SharedData() / "phantom/knee-dev-half");
}

// Twice as many voxels: three levels left 3.8 mm.
TEST_F(FarStart, ABendIsFoundOnFineVoxelsToo) {
  if (!HasSharedData()) GTEST_SKIP() << "../shared is not beside the repository";
  ExpectBelow(0.2, SharedData() / "phantom/knee-dev");
}

}  // namespace
}  // namespace kvx
