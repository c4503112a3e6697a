// Segmentation over HTTP with the real program and the real pipeline.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstring>
#include <fstream>

#include "pipeline/io/volume_file.h"
#include "server/http_library.h"
#include "tests/support/check_contract.h"
#include "tests/support/dicom_segmentation.h"
#include "tests/support/hinge_study.h"
#include "tests/support/served.h"

namespace kvx {
namespace {

using nlohmann::json;
using testing_support::Content;
using testing_support::Hinge;
using testing_support::RunProgram;
using testing_support::ScratchFolder;
using testing_support::Served;

namespace fs = std::filesystem;

// Every third voxel of the bones along each axis, and of what surrounds them.
LabelMap HingeStrokes() {
  const LabelMap truth = Hinge::Labels();
  LabelMap strokes(truth.grid);
  for (size_t v = 0; v < truth.values.size(); ++v) {
    const Eigen::Vector3i p = truth.grid.Ijk(v);
    if (p.y() % 3 == 0 && p.z() % 3 == 0) strokes.values[v] = truth.values[v];
    const bool around = (p.x() + p.y()) % 9 == 0 && p.z() % 4 == 0;
    if (around && truth.values[v] == 0) strokes.values[v] = 255;
  }
  return strokes;
}

// Two balls of 700 HU, one larger, in water.
Volume BallsCt() {
  Grid grid;
  grid.size = {40, 24, 24};
  grid.spacing_mm = {1, 1.1, 1.2};
  Volume scan(grid);
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const Eigen::Vector3d x = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps;
    const double d =
        std::min((x - Eigen::Vector3d(10, 13, 14)).norm() - 8, (x - Eigen::Vector3d(30, 13, 14)).norm() - 6);
    const bool air = grid.Ijk(v).y() < 2;
    scan.values[v] = d < 0 ? 700.0f : air ? -1000.0f : 0.0f;
  }
  return scan;
}

class SegmentService : public testing::Test {
 protected:
  SegmentService() : server_(scratch.path() / "data"), http(server_.url()) {
    http.set_read_timeout(600);
    http.set_logger(testing_support::CheckContract);
  }
  json Post(const std::string& path, const std::string& body, int status) {
    const auto answer = http.Post(path, body, "application/octet-stream");
    EXPECT_TRUE(answer && answer->status == status) << path << " " << (answer ? answer->body : "no answer");
    return answer ? json::parse(answer->body, nullptr, false) : json();
  }
  std::string SubjectWith(const fs::path& scan, const std::string& region) {
    const std::string id = Post("/v1/subjects", json{{"region", region}}.dump(), 201)["id"];
    Post("/v1/subjects/" + id + "/scans?name=pose00&filename=a.nii.gz", Content(scan), 201);
    return "/v1/subjects/" + id;
  }
  json Ended(const std::string& job) {
    while (true) {
      const json state = json::parse(http.Get("/v1/jobs/" + job + "?wait=30")->body);
      if (state["state"] != "queued" && state["state"] != "running") return state;
    }
  }
  fs::path At(const std::string& name) const { return scratch.path() / name; }

  ScratchFolder scratch;
  Served server_;
  httplib::Client http;
};

// What a page draws strokes on: the voxels of the scan, where they are, whatever the format.
TEST_F(SegmentService, AnUploadedScanComesBackAsItWas) {
  WriteVolume(At("balls.nii.gz"), BallsCt(), ScalarType::kInt16);
  const Scan sent = ReadScan(At("balls.nii.gz"));
  const std::string path = SubjectWith(At("balls.nii.gz"), "custom") + "/scans/pose00/volume?format=";
  for (const char* format : {"nii.gz", "nii", "nrrd", "mha"}) {
    const fs::path file = At(std::string("back.") + format);
    std::ofstream(file, std::ios::binary) << http.Get(path + format)->body;
    const Scan back = ReadScan(file);
    EXPECT_EQ(back.volume.values, sent.volume.values) << format;
    EXPECT_EQ(back.volume.grid.size, sent.volume.grid.size) << format;
    EXPECT_TRUE(back.volume.grid.origin.lps.isApprox(sent.volume.grid.origin.lps, 1e-5)) << format;
    EXPECT_TRUE(back.volume.grid.direction.isApprox(sent.volume.grid.direction, 1e-5)) << format;
  }
  const auto raw = http.Get(path + "raw");
  EXPECT_EQ(raw->get_header_value("X-Kinevox-Size"), "40,24,24");
  EXPECT_EQ(raw->get_header_value("X-Kinevox-Type"), "int16");
  ASSERT_EQ(raw->body.size(), 2 * sent.volume.values.size());
  for (size_t v = 0; v < sent.volume.values.size(); ++v) {
    int16_t value;
    std::memcpy(&value, raw->body.data() + 2 * v, 2);
    ASSERT_EQ(value, sent.volume.values[v]) << v;
  }
}

TEST_F(SegmentService, StrokesMakeBonesThatAModelIsBuiltOf) {
  const fs::path study = testing_support::WriteHingeStudy(scratch.path());
  WriteLabels(At("strokes.nii.gz"), HingeStrokes());
  json document = json::parse(Content(study));
  document["bones"].erase("labels");
  document["bones"]["seeds"] = "strokes.nii.gz";
  std::ofstream(At("by_strokes.json")) << document;
  const auto submitted = RunProgram(scratch.path(), {"submit", At("by_strokes.json").string(), "--server",
                                                     server_.url(), "--wait", "--json"});
  ASSERT_EQ(submitted.code, 0) << submitted.err;
  const json outcome = json::parse(submitted.out);
  EXPECT_EQ(outcome["state"], "succeeded");
  const json model = json::parse(http.Get("/v1/models/" + outcome["id"].get<std::string>())->body);
  const std::string subject = "/v1/subjects/" + model["subject"].get<std::string>();
  const json bones = json::parse(http.Get(subject + "/bones")->body)["items"][0];
  EXPECT_EQ(bones["kind"], "seeds");
  std::ofstream(At("made.nrrd"), std::ios::binary)
      << http.Get(subject + "/bones/" + bones["id"].get<std::string>() + "/volume?format=nrrd")->body;
  const LabelMap made = ReadLabels(At("made.nrrd")), truth = Hinge::Labels();
  size_t right = 0, claimed = 0, wanted = 0;
  for (size_t v = 0; v < truth.values.size(); ++v) {
    right += truth.values[v] != 0 && made.values[v] == truth.values[v];
    claimed += made.values[v] != 0, wanted += truth.values[v] != 0;
  }
  EXPECT_GT(2.0 * double(right) / double(claimed + wanted), 0.9);
}

// Whether the study lists its bones or leaves that to its region.
TEST_F(SegmentService, SegmentsThatOverlapAreToldWhenTheyAreSent) {
  json study = json::parse(Content(testing_support::WriteHingeStudy(scratch.path())));
  testing_support::WriteSegmentation(At("seg.dcm"), {.segments = 2, .frames = {{1}, {1, 1}, {2}, {2, 2}}});
  study["bones"]["labels"] = "seg.dcm";
  const auto told = [&](const char* name, const std::string& region) {
    study["name"] = name, study["region"] = region;
    std::ofstream(At("overlap.json")) << study;
    return RunProgram(scratch.path(), {"submit", At("overlap.json").string(), "--server", server_.url()}).err;
  };
  EXPECT_THAT(told("listed", "custom"), testing::HasSubstr("masks share voxels"));
  study["bones"].erase("list");
  study.erase("joints");
  EXPECT_THAT(told("by region", "knee"), testing::ContainsRegex("masks share voxels.*: label 2 \\(5\\)"));
}

TEST_F(SegmentService, MoreStrokesKeepTheBoneThatTheyAgreeWith) {
  WriteVolume(At("mr.nii.gz"), Hinge::ScanOf({}), ScalarType::kUint8);
  LabelMap strokes = HingeStrokes();
  WriteLabels(At("s.nii.gz"), strokes);
  const std::string subject = SubjectWith(At("mr.nii.gz"), "knee");
  const std::string seeds = subject + "/bones?template=pose00&kind=seeds";
  const json first = Ended(Post(seeds, Content(At("s.nii.gz")), 202)["job"]);
  ASSERT_EQ(first["state"], "succeeded") << first;
  const std::string volume = first["result"]["content"], before_id = first["result"]["bones"];
  std::ofstream(At("before.nii.gz"), std::ios::binary) << http.Get(volume)->body;
  const LabelMap before = ReadLabels(At("before.nii.gz"));
  size_t marked = 0;  // the first voxel of bone 2 without a stroke becomes background
  while (before.values[marked] != 2 || strokes.values[marked] != 0) ++marked;
  strokes.values[marked] = 255;
  WriteLabels(At("more.nii.gz"), strokes);
  const json second = Ended(Post(seeds + "&previous=" + before_id, Content(At("more.nii.gz")), 202)["job"]);
  ASSERT_EQ(second["state"], "succeeded") << second;
  std::ofstream(At("after.nii.gz"), std::ios::binary)
      << http.Get(second["result"]["content"].get<std::string>())->body;
  const auto made = RunProgram(scratch.path(), {"segment", At("mr.nii.gz"), "--seeds", At("more.nii.gz"),
                                                "--previous", At("before.nii.gz"), "--out", At("cli.nrrd")});
  ASSERT_EQ(made.code, 0) << made.err;
  const LabelMap after = ReadLabels(At("after.nii.gz"));
  EXPECT_EQ(ReadLabels(At("cli.nrrd")).values, after.values) << "the service does as the command does";
  EXPECT_EQ(after.values[marked], 0);
  for (size_t v = 0; v < after.values.size(); ++v) EXPECT_EQ(after.values[v] == 1, before.values[v] == 1);
}

TEST_F(SegmentService, BackgroundAloneCorrectsAnEarlierLabelMap) {
  WriteVolume(At("mr.nii.gz"), Hinge::ScanOf({}), ScalarType::kUint8);
  LabelMap wanted = Hinge::Labels(), strokes(wanted.grid);
  WriteLabels(At("before.nii.gz"), wanted);
  const auto marked = size_t(std::ranges::find(wanted.values, 2) - wanted.values.begin());
  strokes.values[marked] = 255, wanted.values[marked] = 0;
  WriteLabels(At("s.nii.gz"), strokes);
  const std::string bones = SubjectWith(At("mr.nii.gz"), "custom") + "/bones?template=pose00";
  const std::string before = Post(bones, Content(At("before.nii.gz")), 201)["id"];
  Post(bones + "&kind=seeds", Content(At("s.nii.gz")), 400);
  const json job = Ended(Post(bones + "&kind=seeds&previous=" + before, Content(At("s.nii.gz")), 202)["job"]);
  ASSERT_EQ(job["state"], "succeeded") << job;
  ASSERT_EQ(job["result"]["warnings"].size(), 1u) << job;
  EXPECT_EQ(job["result"]["warnings"][0].get<std::string>().substr(0, 7), "bone 2:");
  std::ofstream(At("after.nii.gz"), std::ios::binary)
      << http.Get(job["result"]["content"].get<std::string>())->body;
  EXPECT_EQ(ReadLabels(At("after.nii.gz")).values, wanted.values);
  const auto made = RunProgram(scratch.path(), {"segment", At("mr.nii.gz"), "--seeds", At("s.nii.gz"),
                                                "--previous", At("before.nii.gz"), "--out", At("cli.nrrd")});
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_NE(made.err.find("bone 2:"), std::string::npos) << made.err;
  EXPECT_EQ(ReadLabels(At("cli.nrrd")).values, wanted.values);
}

// Before the bones are looked for: every other slice of this scan is a quarter brighter.
TEST_F(SegmentService, SaysWhatWasDoneToTheScan) {
  Volume striped = Hinge::ScanOf({});
  for (size_t v = 0; v < striped.values.size(); ++v)
    striped.values[v] *= striped.grid.Ijk(v).z() % 2 == 0 ? 0.8f : 1.0f;
  WriteVolume(At("mr.nii.gz"), striped, ScalarType::kFloat32);
  WriteLabels(At("s.nii.gz"), HingeStrokes());
  const std::string bones = SubjectWith(At("mr.nii.gz"), "custom") + "/bones?template=pose00";
  const json job = Ended(Post(bones + "&kind=seeds", Content(At("s.nii.gz")), 202)["job"]);
  ASSERT_EQ(job["state"], "succeeded") << job;
  ASSERT_FALSE(job["result"]["warnings"].empty()) << job;
  EXPECT_THAT(job["result"]["warnings"][0].get<std::string>(),
              testing::StartsWith("the scan: every other slice was"));
  const auto made = RunProgram(
      scratch.path(), {"segment", At("mr.nii.gz"), "--seeds", At("s.nii.gz"), "--out", At("cli.nrrd")});
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_THAT(made.err, testing::HasSubstr("every other slice was"));
}

TEST_F(SegmentService, AScanIsNoLabelMap) {
  Volume ramp(BallsCt().grid);
  for (size_t v = 0; v < ramp.values.size(); ++v) ramp.values[v] = float(v % 1000);
  WriteVolume(At("mr.nii.gz"), ramp, ScalarType::kInt16);
  const std::string subject = SubjectWith(At("mr.nii.gz"), "custom");
  const json refused =
      Post(subject + "/bones?template=pose00&filename=a.nii.gz", Content(At("mr.nii.gz")), 400);
  EXPECT_NE(refused["detail"].get<std::string>().find("label map"), std::string::npos);
  EXPECT_TRUE(json::parse(http.Get(subject + "/bones")->body)["items"].empty());
}

TEST_F(SegmentService, ALabelMapThatLiesElsewhereThanItsScanIsRefused) {
  WriteVolume(At("mr.nii.gz"), Hinge::ScanOf({}), ScalarType::kUint8);
  const std::string subject = SubjectWith(At("mr.nii.gz"), "knee");
  LabelMap labels = Hinge::Labels();
  WriteLabels(At("right.nii.gz"), labels);
  labels.grid.origin.lps.x() += 1000;
  WriteLabels(At("far.nii.gz"), labels);
  const std::string bones = subject + "/bones?template=pose00&filename=a.nii.gz";
  Post(bones, Content(At("right.nii.gz")), 201);
  const json refused = Post(bones, Content(At("far.nii.gz")), 400);
  EXPECT_NE(refused["detail"].get<std::string>().find("elsewhere"), std::string::npos) << refused;
  EXPECT_EQ(json::parse(http.Get(subject + "/bones")->body)["items"].size(), 1);
}

TEST_F(SegmentService, AThresholdOfACtNumbersBySize) {
  WriteVolume(At("ct.nii.gz"), BallsCt(), ScalarType::kInt16);
  const std::string subject = SubjectWith(At("ct.nii.gz"), "custom");
  const json accepted = Post(subject + "/bones?template=pose00&kind=threshold", "", 202);
  const json job = Ended(accepted["job"]);
  ASSERT_EQ(job["state"], "succeeded") << job;
  const auto listed = RunProgram(scratch.path(), {"jobs", "--server", server_.url()});
  EXPECT_EQ(listed.code, 0) << listed.err;
  EXPECT_NE(listed.out.find(accepted["job"].get<std::string>()), std::string::npos)
      << "it has no model, yet a line";
  const json bones = json::parse(http.Get(subject + "/bones/" + accepted["id"].get<std::string>())->body);
  ASSERT_EQ(bones["list"].size(), 2u) << bones;
  EXPECT_NEAR(bones["list"][0]["centre"][0].get<double>(), 10, 0.5) << "the larger ball, LPS";
  EXPECT_NEAR(bones["list"][1]["cm3"].get<double>(), 4.0 / 3 * M_PI * 0.216, 0.1);
  EXPECT_TRUE(bones["list"][0]["name"].is_null());
  const auto made = RunProgram(scratch.path(), {"segment", At("ct.nii.gz"), "--threshold", "auto", "--json",
                                                "--quiet", "--out", At("cli.nrrd")});
  ASSERT_EQ(made.code, 0) << made.err;
  EXPECT_EQ(json::parse(made.out)["bones"], bones["list"])
      << "the command says of bones what the service says";
  std::ofstream(At("study.json")) << R"({"name": "balls", "region": "custom", "template": "a",
      "scans": [{"name": "a", "volume": "ct.nii.gz"}],
      "bones": {"threshold": "auto", "list": [{"label": 1, "name": "ball", "parnet": "b"}]}})";
  const auto of_study =
      RunProgram(scratch.path(), {"segment", At("study.json"), "--out", At("by_study.nrrd")});
  EXPECT_NE(of_study.err.find("misspelt? bones.list[0].parnet"), std::string::npos) << of_study.err;
  Post(subject + "/bones?template=pose00&kind=threshold&threshold=3000", "", 400);
  Post(subject + "/bones?template=pose00&kind=threshold", "strokes?", 400);
}

TEST_F(SegmentService, SaysWhatIsWrongWithStrokesAndKeepsNothing) {
  WriteVolume(At("mr.nii.gz"), Hinge::ScanOf({}), ScalarType::kUint8);
  const std::string subject = SubjectWith(At("mr.nii.gz"), "knee");
  const std::string bones = subject + "/bones?template=pose00&kind=";
  const auto refused = [&](LabelMap strokes, const char* why) {
    WriteLabels(At("s.nii.gz"), strokes);
    EXPECT_THAT(Post(bones + "seeds", Content(At("s.nii.gz")), 400)["detail"].get<std::string>(),
                testing::HasSubstr(why));
  };
  const LabelMap good = HingeStrokes();
  LabelMap empty(good.grid), background(good.grid), elsewhere = good, outside = good;
  background.values[700] = 255;
  elsewhere.grid.origin.lps.x() += 30;
  outside.grid.size.z() -= 1, outside.values.resize(outside.grid.VoxelCount()),
      outside.grid.origin.lps.z() += 300;
  refused(empty, "empty");
  refused(background, "background alone");
  refused(elsewhere, "another place");
  refused(outside, "outside the scan");
  Post(bones + "threshold", "", 400);
  Post(bones + "nonsense", "", 400);
  EXPECT_TRUE(json::parse(http.Get("/v1/jobs")->body)["items"].empty());
  size_t blobs = 0;
  for (const auto& entry : fs::recursive_directory_iterator(scratch.path() / "data" / "blobs"))
    blobs += entry.is_regular_file();
  EXPECT_EQ(blobs, 1u) << "the scan alone";
}

}  // namespace
}  // namespace kvx
