// Registration from far off, without bones that would say where: the paper's Table 2.
#include <gtest/gtest.h>

#include <fstream>
#include <numeric>

#include <nlohmann/json.hpp>

#include "tests/support/program_test.h"

namespace kvx {
namespace {

using testing_support::HasSharedData;
using testing_support::SharedData;

class FarStart : public testing_support::ProgramTest {
 protected:
  void ExpectBelow(double most_mm, size_t levels, const std::filesystem::path& phantom);

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

// Over the phantom's points, of the scan bent mechanically, as `evaluate` compares it with the truth.
void FarStart::ExpectBelow(double most_mm, size_t levels, const std::filesystem::path& phantom) {
  const testing_support::Ended built =
      Run({"build", Study(phantom, "bend10_mech"), "--out", At("m"), "--quiet"});
  ASSERT_EQ(built.code, 0) << built.err;
  const testing_support::Ended compared = Run({"evaluate", At("m"), "--truth", phantom.string(), "--json"});
  ASSERT_EQ(compared.code, 0) << compared.err;
  const nlohmann::json scan = nlohmann::json::parse(compared.out).at("scans").at(0);
  EXPECT_GT(scan.at("distances").at("register").at("points"), 19000);
  EXPECT_GT(scan.at("distances").at("initialise").at("med"), 5) << "nothing says how the shin moved";
  EXPECT_LT(scan.at("distances").at("register").at("med"), most_mm);
  const auto points = scan.at("control_points_per_level").get<std::vector<int64_t>>();
  EXPECT_EQ(points.size(), levels);
  EXPECT_EQ(std::accumulate(points.begin(), points.end(), int64_t(0)), scan.at("control_points"));
}

// 24 mm at the end of the leg. The issue asks for 0.45 mm; wide blocks on the coarsest of three levels left
// 0.38.
TEST_F(FarStart, ABendOfTenDegreesIsFoundFromNothing) {
  if (!HasSharedData()) GTEST_SKIP() << "../shared is not beside the repository";
  ExpectBelow(0.2, 3, SharedData() / "phantom/knee-dev-half");
}

// Twice as many voxels: three levels left 3.8 mm.
TEST_F(FarStart, ABendIsFoundOnFineVoxelsToo) {
  if (!HasSharedData()) GTEST_SKIP() << "../shared is not beside the repository";
  ExpectBelow(0.2, 4, SharedData() / "phantom/knee-dev");
}

}  // namespace
}  // namespace kvx
