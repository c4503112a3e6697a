// What a client gets of a model that a service has built.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "server/http_library.h"
#include "tests/support/hinge_study.h"
#include "tests/support/program_test.h"
#include "tests/support/served.h"

namespace kvx {
namespace {

using nlohmann::json;

class BuiltOnService : public testing_support::ProgramTest {
 protected:
  BuiltOnService() {
    const std::string study = testing_support::WriteHingeStudy(scratch.path()).string();
    model = RunJson({"submit", study, "--server", server.url(), "--wait", "--quiet"})["id"];
  }
  const testing_support::Served server{scratch.path() / "data"};
  std::string model;
};

// They have no header of their own.
TEST_F(BuiltOnService, RawVoxelsComeWithTheirGeometry) {
  const std::vector<std::string> fetch{"fetch",  model,   "--server",       server.url(), "--scan",
                                       "pose01", "--out", At("voxels.raw"), "--quiet"};
  const json raw = RunJson(fetch);
  ASSERT_EQ(raw["size"].size(), 3u) << raw;
  EXPECT_EQ(raw["spacing"][0], 1.25);
  EXPECT_EQ(raw["origin"].size(), 3u);
  EXPECT_EQ(raw["direction"].size(), 9u);
  EXPECT_EQ(raw["type"], "uint8");
  EXPECT_EQ(raw["bytes"], raw["size"][0].get<int>() * raw["size"][1].get<int>() * raw["size"][2].get<int>());
  EXPECT_NE(Run(fetch).err.find("spacing 1.25,"), std::string::npos);
}

TEST_F(BuiltOnService, AMotionOfTooManyFramesIsRefusedBeforeAnyIsPosed) {
  const std::string motion = R"({"fps": 1000, "frames": [{"time": 0, "joints": {}},
      {"time": 99, "joints": {"nobody.flexion": 1}}]})";
  const auto refused =
      httplib::Client(server.url()).Post("/v1/models/" + model + "/animations", motion, "application/json");
  ASSERT_TRUE(refused);
  EXPECT_EQ(refused->status, 400) << refused->body;
}

}  // namespace
}  // namespace kvx
