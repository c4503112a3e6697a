// Poses as files: three ways to say one, and what is refused.
#include "pipeline/model/files/pose_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <thread>

#include "core/errors.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

using testing::HasSubstr;

TEST(PoseFile, DegreesBecomeRadians) {
  const auto pose =
      std::get<AnglePose>(ParsePose(R"({"joints": {"tibia.flexion": 90, "patella.tilt": -45}})"));
  EXPECT_DOUBLE_EQ(pose.angles_rad.at("tibia.flexion"), kPi / 2);
  EXPECT_DOUBLE_EQ(pose.angles_rad.at("patella.tilt"), -kPi / 4);
}

TEST(PoseFile, BonesAndScans) {
  const auto bones = std::get<BonePose>(
      ParsePose(R"({"scan_from_template": {"femur": [1,0,0,4, 0,1,0,5, 0,0,1,6, 0,0,0,1]}})"));
  EXPECT_EQ(bones.scan_from_template.at("femur").translation_mm, Eigen::Vector3d(4, 5, 6));
  EXPECT_EQ(std::get<ScanPose>(ParsePose(R"({"scan": "pose01"})")).scan, "pose01");
}

// As a shell's <(…) gives it.
TEST(PoseFile, APipeIsAFileToo) {
  const testing_support::ScratchFolder folder;
  const std::filesystem::path pipe = folder.path() / "pose";
  ASSERT_EQ(::mkfifo(pipe.c_str(), 0600), 0);
  std::thread writer([&] { std::ofstream(pipe) << R"({"scan": "pose01"})"; });
  EXPECT_EQ(std::get<ScanPose>(ReadPose(pipe)).scan, "pose01");
  writer.join();
  EXPECT_THROW(ReadPose("/dev/null"), InputError);
}

TEST(PoseFile, WrongOnesAreRefused) {
  for (const char* text :
       {R"({})", R"({"joints": {}, "scan": "a"})", R"({"joints": {"tibia.flexion": "35"}})",
        R"({"joints": [1]})", R"({"joints": {"tibia flexion": 3}})", R"({"scan": "a/b"})",
        R"({"joints": {"a.x": 35, "a.x": 36}})", R"({"joints": {"a": 1e999}})",
        R"({"scan_from_template": {"femur": [1]}})"}) {
    EXPECT_THROW(ParsePose(text), InputError) << text;
  }
}

TEST(PoseFile, FieldsThatNobodyReadsAreRefusedByName) {
  EXPECT_THAT([] { ParsePose(R"({"scan": "pose03", "mode": "vbd", "level": 3})"); },
              testing::ThrowsMessage<InputError>(HasSubstr("'level' in a pose")));
}

}  // namespace
}  // namespace kvx
