// Files that the user names: missing ones are exit code 5, damaged ones 3, and the message says which.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/support/dicom_segmentation.h"
#include "tests/support/hinge_study.h"
#include "tests/support/program_test.h"
#include "tests/support/without_root_powers.h"

namespace kvx {
namespace {

using testing::HasSubstr;
using testing::StartsWith;
using testing_support::Ended;
using testing_support::HasSharedData;
using testing_support::SharedData;

namespace fs = std::filesystem;
constexpr int kInput = 3, kNotFound = 5, kRefused = 6;

class NamedFiles : public testing_support::ProgramTest {
 protected:
  std::string Put(const std::string& name, const std::string& text) const {
    std::ofstream(At(name)) << text;
    return At(name);
  }
  void ExpectRefused(const std::vector<std::string>& arguments, int code, const std::string& named) const {
    SCOPED_TRACE(testing::PrintToString(arguments));
    const Ended ended = Run(arguments);
    EXPECT_EQ(ended.code, code) << ended.err;
    EXPECT_THAT(ended.err, StartsWith("kinevox: " + named));
  }
};

TEST_F(NamedFiles, WhatIsNotThereIsNotFoundWhereverItIsNamed) {
  const std::string none = At("none.json"), table = Put("p.csv", "x,y,z\n");
  const std::vector<std::vector<std::string>> commands{
      {"build", none, "--out", At("m")},
      {"submit", none},
      {"segment", none, "--out", At("o.nii.gz")},
      {"pose", At("m"), "--pose", none, "--out", At("o.nii.gz")},
      {"fetch", "mdl_1", "--pose", none, "--out", At("o.nii.gz")},
      {"animate", At("m"), "--keyframes", none, "--out", At("o")},
      {"animate", At("m"), "--keyframes", table, "--map", none, "--out", At("o")},
      {"plan-poses", At("m"), "--motion", none},
      {"map-points", At("m"), "--scan", "a", "--points", none, "--out", At("o.csv")},
      {"evaluate", At("m"), "--truth", none},
      {"slices", none, "--out", At("o.png")},
      {"serve", "--config", none, "--print-config"}};
  for (const auto& command : commands) ExpectRefused(command, kNotFound, none + " does not exist");
}

// Where a file ends inside of an element, GDCM ends the process that reads it.
TEST_F(NamedFiles, ASegmentationThatEndsItsReaderIsRefused) {
  const fs::path damaged = At("seg.dcm");
  testing_support::WriteSegmentation(damaged, 2);
  const size_t rows = testing_support::Content(damaged).find(std::string("\x28\0\x10\0US", 6));
  ASSERT_NE(rows, std::string::npos);
  fs::resize_file(damaged, rows + 7);
  testing_support::WriteHingeStudy(scratch.path());
  auto study = nlohmann::json::parse(std::ifstream(At("study.json")));
  const std::string scan = At(study["scans"][0]["volume"]);
  for (const char* field : {"labels", "seeds"}) {
    study["bones"].erase("labels");
    study["bones"][field] = "seg.dcm";
    std::ofstream(At("damaged.json")) << study;
    ExpectRefused({"build", At("damaged.json"), "--out", At("m")}, kInput, std::string("bones.") + field);
    study["bones"].erase(field);
  }
  ExpectRefused({"segment", scan, "--seeds", damaged, "--out", At("o.nii.gz")}, kInput, "the strokes");
}

TEST_F(NamedFiles, AFolderIsNoFile) {
  const std::string folder = At("folder"), table = Put("p.csv", "x,y,z\n");
  fs::create_directory(folder);
  const std::vector<std::vector<std::string>> commands{
      {"build", folder, "--out", At("m")},
      {"pose", At("m"), "--pose", folder, "--out", At("o.nii.gz")},
      {"fetch", "mdl_1", "--pose", folder, "--out", At("o.nii.gz")},
      {"animate", At("m"), "--keyframes", table, "--map", folder, "--out", At("o")},
      {"map-points", At("m"), "--scan", "a", "--points", folder, "--out", At("o.csv")},
      {"serve", "--config", folder, "--print-config"}};
  for (const auto& command : commands) ExpectRefused(command, kInput, folder + ": ");
}

TEST_F(NamedFiles, AnOutputTakesNoPlaceOfWhatItIsMadeFrom) {
  const std::string scan = Put("scan.nii", "nii"), strokes = Put("strokes.nii", "nii");
  const std::string study = Put("study.json", R"({"name": "a", "region": "knee", "template": "p",
      "scans": [{"name": "p", "volume": "scan.nii"}], "bones": {"seeds": "strokes.nii"}})");
  fs::create_symlink(scan, At("link.nii"));
  constexpr int kUsage = 2;
  const auto refused = [&](const std::vector<std::string>& command, const char* what) {
    ExpectRefused(command, kUsage, "the output would take the place of " + std::string(what));
  };
  for (const std::string& out : {scan, At("./scan.nii"), At("link.nii")})
    refused({"segment", scan, "--seeds", strokes, "--out", out}, "the scan");
  refused({"segment", scan, "--threshold", "auto", "--out", scan}, "the scan");
  refused({"segment", scan, "--seeds", strokes, "--out", strokes}, "the strokes");
  refused({"segment", study, "--out", scan}, "the scan");
  refused({"segment", study, "--out", strokes}, "the strokes");
  refused({"pose", At("m"), "--scan", "p", "--out", At("o.nii"), "--extrapolation-map", At("./o.nii")},
          "the extrapolation map");
  EXPECT_EQ(testing_support::Content(scan) + testing_support::Content(strokes), "niinii");
}

TEST_F(NamedFiles, WhatThePersonMayNotDoIsRefused) {
  const std::string closed = At("closed"), hidden = Put("hidden.json", "{}"), scan = Put("hidden.nii", "nii"),
                    model = At("m");
  for (const std::string& folder : {closed, model}) fs::create_directory(folder);
  const auto allow = [&](fs::perms of_folders, fs::perms of_files) {
    for (const std::string& folder : {closed, model}) fs::permissions(folder, of_folders);
    for (const std::string& file : {hidden, scan}) fs::permissions(file, of_files);
  };
  allow(fs::perms::owner_read, fs::perms::none);
  const std::vector<std::vector<std::string>> commands{
      {"phantom", "knee", "--scale", "half", "--out", closed + "/p"},
      {"serve", "--data", closed + "/d", "--listen", "127.0.0.1:0"},
      {"build", hidden, "--out", At("n")},
      {"slices", scan, "--out", At("o.png")},
      {"info", model}};
  for (const auto& command : commands) {
    Ended ended;
    testing_support::WithoutRootPowers([&] { ended = Run(command); });
    EXPECT_EQ(ended.code, kRefused) << command.front() << ": " << ended.err;
    EXPECT_THAT(ended.err, testing::ContainsRegex("may not be (read|written|created)")) << command.front();
  }
  allow(fs::perms::owner_all, fs::perms::owner_all);  // so that they can be removed
}

TEST_F(NamedFiles, WhatIsWrongIsToldByItsName) {
  const std::string bad = Put("bad.json", "{"), points = Put("p.csv", "a,b\n");
  Put("cut.nii", "cut");
  const std::string study = Put(
      "study.json", R"({"name": "s", "region": "custom", "scans": [{"name": "a", "volume": "gone.nii"}]})");
  ExpectRefused({"build", bad, "--out", At("m")}, kInput, bad + ": ");
  ExpectRefused({"build", study, "--out", At("m")}, kInput, study + ": scans[0].volume");
  ExpectRefused({"submit", bad}, kInput, bad + ": ");
  ExpectRefused({"pose", At("m"), "--pose", bad, "--out", At("o.nii.gz")}, kInput, bad + ": ");
  ExpectRefused({"animate", At("m"), "--keyframes", bad, "--out", At("o")}, kInput, bad + ": ");
  ExpectRefused({"map-points", At("m"), "--scan", "a", "--points", points, "--out", At("o.csv")}, kInput,
                points + ": ");
  ExpectRefused({"slices", At("cut.nii"), "--out", At("o.png")}, kInput, At("cut.nii") + ": ");
  ExpectRefused({"segment", At("cut.nii"), "--threshold", "auto", "--out", At("o.nii.gz")}, kInput,
                At("cut.nii") + ": ");
}

TEST_F(NamedFiles, AScanThatTheServiceCannotCallSoIsToldBeforeAnythingIsSent) {
  Put("a.nii", "never read"), Put("b.nii", "never read");
  const std::string study = Put("study.json", R"({"name": "s", "region": "knee", "template": "a",
      "scans": [{"name": "a", "volume": "a.nii"}, {"name": ".b", "volume": "b.nii"}],
      "bones": {"labels": "a.nii"}})");
  ExpectRefused({"submit", study, "--server", "http://127.0.0.1:1"}, kInput,
                study + ": the name of scan '.b' has");
}

TEST_F(NamedFiles, ADicomImageThatBreaksItsReaderIsRefusedByItsScan) {
  if (!HasSharedData()) GTEST_SKIP() << "without shared data";
  fs::copy(SharedData() / "torso-pelvis-ct/dicom", At("series"));
  const fs::path image = std::next(fs::directory_iterator(At("series")), 4)->path();
  fs::permissions(image, fs::perms::owner_write, fs::perm_options::add);
  fs::resize_file(image, 2000);
  const std::string study =
      Put("study.json", R"({"name": "s", "region": "custom", "template": "a", "scans": [{"name": "a",
          "volume": "series"}], "bones": {"threshold": "auto", "list": [{"label": 1, "name": "x"}]}})");
  ExpectRefused({"build", study, "--out", At("m"), "--quiet"}, kInput, "scan 'a': ");
  ExpectRefused({"segment", study, "--out", At("o.nii.gz")}, kInput, "scan 'a': ");
  ExpectRefused({"slices", At("series"), "--out", At("o.png")}, kInput, At("series") + ": ");
}

}  // namespace
}  // namespace kvx
