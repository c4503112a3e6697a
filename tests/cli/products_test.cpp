// Slices, surfaces, animations, fields and plans of a tiny model, through the real program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "pipeline/io/volume_file.h"
#include "tests/support/fixtures.h"
#include "tests/support/hinge_model_test.h"
#include "tests/support/program.h"

namespace kvx {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing_support::Ended;
using testing_support::RunProgram;
using testing_support::ScratchFolder;

class Products : public testing_support::HingeModelTest {
 protected:
  static void SetUpTestSuite() {
    HingeModelTest::SetUpTestSuite();
    std::ofstream(At("bend.json"))
        << R"({"fps": 4, "frames": [{"time": 0, "joints": {}}, {"time": 0.5, "joints": {"lower.flexion": 30}}]})";
  }
  static std::string Start(const std::string& name, size_t bytes) {
    std::ifstream file(At(name), std::ios::binary);
    std::string start(bytes, '\0');
    file.read(start.data(), std::streamsize(bytes));
    return start;
  }
};

TEST_F(Products, SlicesArePicturesOrLayers) {
  ExpectDone(
      {"slice", At("model"), "--joint", "lower.flexion=20", "--axis", "sagittal", "--out", At("s.png")});
  EXPECT_EQ(Start("s.png", 4), "\x89PNG");
  ExpectDone({"slice", At("model"), "--scan", "pose01", "--centre", "0,0,0", "--right", "1,0,0", "--down",
              "-1,0,-1", "--projection", "max", "--out", At("s.nrrd")});
  EXPECT_EQ(Start("s.nrrd", 4), "NRRD");
  EXPECT_EQ(Run({"slice", At("model"), "--scan", "pose01", "--centre", "0,0,0", "--out", At("x.png")}).code,
            2);
  EXPECT_EQ(Run({"slice", At("model"), "--scan", "pose01", "--window", "9,3", "--out", At("x.png")}).code, 2);
}

TEST_F(Products, SlicesAndPointsAreToldAsDocuments) {
  const auto told = [](const std::vector<std::string>& words) {
    const Ended ended = Run(words);
    EXPECT_EQ(ended.code, 0) << ended.err;
    return json::parse(ended.out, nullptr, false);
  };
  const json picture = told({"slice", At("model"), "--scan", "pose01", "--out", At("s.png"), "--json"}),
             layer = told({"slice", At("model"), "--scan", "pose01", "--out", At("s.nrrd"), "--json"});
  EXPECT_EQ(picture["size"][2], 1);
  EXPECT_EQ(picture["window"].size(), 2u);
  EXPECT_EQ(layer["origin"], picture["origin"]);
  EXPECT_FALSE(layer.contains("window")) << "its values are the scan's";
  std::ofstream(At("two.csv")) << "x,y,z\n0,0,0\n900,0,0\n";
  EXPECT_EQ(told({"map-points", At("model"), "--scan", "pose01", "--inverse", "--points", At("two.csv"),
                  "--out", At("back.csv"), "--json"}),
            (json{{"points", 2}, {"lost", 1}}));
}

// All of it is black, and nothing else says so.
TEST_F(Products, APlaneBesideTheBodyIsWarnedOf) {
  const auto told = [](const std::vector<std::string>& plane) {
    std::vector<std::string> words{"slice", At("model"), "--joint", "lower.flexion=20", "--out", At("s.png")};
    words.insert(words.end(), plane.begin(), plane.end());
    const Ended ended = Run(words);
    EXPECT_EQ(ended.code, 0) << ended.err;
    return ended.err;
  };
  const std::string beside = "the plane lies beside the posed body";
  for (const std::string axis : {"axial", "coronal", "sagittal"}) {
    const std::string warning = told({"--axis", axis, "--mm", "5000"}), reaches = "reaches from ";
    ASSERT_THAT(warning, HasSubstr(beside)) << axis;
    double from = 0, to = 0;
    std::istringstream reach(warning.substr(warning.find(reaches) + reaches.size()));
    std::string word;
    ASSERT_TRUE(reach >> from >> word >> to) << warning;
    for (const double inside : {from + 1, to - 1})
      EXPECT_EQ(told({"--axis", axis, "--mm", std::to_string(inside)}), "") << axis;
    for (const double outside : {from - 1, to + 1})
      EXPECT_THAT(told({"--axis", axis, "--mm", std::to_string(outside)}), HasSubstr(beside)) << axis;
  }
  EXPECT_THAT(told({"--centre", "0,0,999", "--right", "1,0,0", "--down", "0,1,0"}), HasSubstr(beside));
  EXPECT_EQ(told({"--centre", "0,0,0", "--right", "1,0,0", "--down", "0,1,0"}), "");
  EXPECT_EQ(told({"--projection", "max", "--mm", "5000"}), "") << "of the whole body";
  EXPECT_THAT(told({"--projection", "max", "--mm", "5000", "--slab-mm", "9"}), HasSubstr(beside));
  const Ended video = Run({"animate", At("model"), "--keyframes", At("bend.json"), "--axis", "coronal",
                           "--mm", "5000", "--out", At("beside"), "--quiet"});
  EXPECT_EQ(video.code, 0);
  EXPECT_THAT(video.err, HasSubstr(beside));
}

TEST_F(Products, OptionsThatWouldChangeNothingAreRefused) {
  const auto refused = [](std::vector<std::string> words, const char* option) {
    words.insert(words.end(), {"--out", At("x.nrrd")});
    const Ended ended = Run(words);
    EXPECT_EQ(ended.code, 2) << words[0] << ended.err;
    EXPECT_THAT(ended.err, HasSubstr(option));
  };
  const std::string model = At("model");
  for (const char* map : {"--forward", "--inverse", "--confidence", "--error"}) {
    refused({"field", model, "--scan", "pose01", map, "--level", "4"}, "--level");
    refused({"field", model, "--scan", "pose01", map, "--mode", "vbd"}, "--mode");
  }
  refused({"segment", At("study.json"), "--region", "hand"}, "--region");
  refused({"slice", model, "--scan", "pose01", "--window", "0,100"}, "--window");
}

// What HTTP calls 'slab_mm' is --slab-mm here.
TEST_F(Products, RefusalsNameTheOption) {
  const auto refusal = [](std::vector<std::string> words, int code) {
    words.insert(words.begin() + 1, {At("model"), "--scan", "pose01"});
    const Ended ended = Run(words);
    EXPECT_EQ(ended.code, code) << ended.err;
    return ended.err;
  };
  const std::string png = At("x.png");
  for (const std::string option : {"--slab-mm", "--width-mm", "--height-mm", "--pixel-mm"})
    EXPECT_THAT(refusal({"slice", "--projection", "max", option, "0", "--out", png}, 2), HasSubstr(option));
  EXPECT_THAT(refusal({"slice", "--window", "200,-100", "--out", png}, 2), HasSubstr("--window is two"));
  EXPECT_THAT(refusal({"slice", "--slab-mm", "5", "--out", png}, 2), HasSubstr("give a --projection"));
  EXPECT_THAT(refusal({"slice", "--pixel-mm", "0.001", "--out", png}, 3),
              HasSubstr("make --pixel-mm larger"));
  EXPECT_THAT(refusal({"pose", "--extrapolation-map", At("e.xyz"), "--out", At("x.nrrd")}, 3),
              HasSubstr("--extrapolation-map: "));
  EXPECT_FALSE(std::filesystem::exists(At("x.nrrd")));
  EXPECT_THAT(refusal({"surface", "--bone", "nope", "--out", At("x.stl")}, 5), HasSubstr("upper, lower"));
}

TEST_F(Products, InfoTellsWhatTheBuildDoubted) {
  LabelMap labels = testing_support::Hinge::Labels();
  labels(0, 0, 0) = 77;
  WriteLabels(At("more_labels.nii.gz"), labels);
  std::ifstream study(At("study.json"));
  std::string text{std::istreambuf_iterator<char>(study), {}};
  text.replace(text.find("bones.nii.gz"), 12, "more_labels.nii.gz");
  std::ofstream(At("more.json")) << text;
  const std::string doubt = "a bone encloses them: 77";
  const Ended built = Run({"build", At("more.json"), "--out", At("more"), "--quiet"});
  EXPECT_NE(built.err.find(doubt), std::string::npos) << built.err;
  const std::string told = Run({"info", At("more")}).out;
  EXPECT_NE(told.find("warning: "), std::string::npos);
  EXPECT_NE(told.find(doubt), std::string::npos);
  EXPECT_EQ(told.find(doubt), told.rfind(doubt)) << "once";
  EXPECT_NE(Run({"info", At("more"), "--json"}).out.find(doubt), std::string::npos);
}

TEST_F(Products, InfoSaysWhyThreeAxesHaveNoBound) {
  std::ifstream study(At("study.json"));
  std::string text{std::istreambuf_iterator<char>(study), {}};
  const std::string one = R"(["flexion"])", why = "three axes explain every turn";
  text.replace(text.find(one), one.size(), R"(["flexion", "abduction", "rotation"])");
  std::ofstream(At("three.json")) << text;
  EXPECT_EQ(Run({"build", At("three.json"), "--out", At("three"), "--quiet"}).code, 0);
  EXPECT_NE(Run({"info", At("three")}).out.find(why), std::string::npos);
  EXPECT_EQ(Run({"info", At("model")}).out.find(why), std::string::npos);
}

TEST_F(Products, SurfacesAreClosed) {
  const Ended ended =
      Run({"surface", At("model"), "--joint", "lower.flexion=20", "--out", At("all.glb"), "--json"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  const json surfaces = json::parse(ended.out)["surfaces"];
  ASSERT_EQ(surfaces.size(), 3u);
  for (const json& surface : surfaces) {
    EXPECT_TRUE(surface["closed"]) << surface.dump();
    EXPECT_GT(surface["volume_mm3"], 0);
  }
  EXPECT_EQ(Start("all.glb", 4), "glTF");
  ExpectDone({"surface", At("model"), "--scan", "pose02", "--bone", "lower", "--out", At("lower.stl")});
  const auto of = [](const std::string& bones) {
    return Run({"surface", At("model"), "--scan", "pose02", "--bone", bones, "--out", At("x.stl"), "--json"});
  };
  const json both = json::parse(of("lower,upper,lower").out)["surfaces"];
  ASSERT_EQ(both.size(), 2u) << "as HTTP's bone=lower,upper,lower";
  EXPECT_EQ(both[0]["name"], "lower");
  EXPECT_EQ(of(",").code, 2);
  const Ended missing = of("lower,tail");
  EXPECT_EQ(missing.code, 5);
  EXPECT_THAT(missing.err, HasSubstr("tail"));
}

TEST_F(Products, AnimationsAreFoldersOrOneFile) {
  const Ended ended = Run({"animate", At("model"), "--keyframes", At("bend.json"), "--level", "1", "--out",
                           At("frames"), "--quiet", "--json"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  EXPECT_EQ(json::parse(ended.out)["frames"], 3);
  EXPECT_EQ(ReadVolumeInfo(At("frames/frame_0002.nii.gz")).grid,
            ReadVolumeInfo(At("frames/frame_0000.nii.gz")).grid);
  ExpectDone({"animate", At("model"), "--keyframes", At("bend.json"), "--out", At("bend.nii.gz"), "--quiet"});
  EXPECT_GT(std::filesystem::file_size(At("bend.nii.gz")), 1000u);
  ExpectDone({"animate", At("model"), "--keyframes", At("bend.json"), "--axis", "coronal", "--out",
              At("pictures"), "--quiet"});
  EXPECT_EQ(Start("pictures/frame_0001.png", 4), "\x89PNG");
  const Ended wrong = Run(
      {"animate", At("model"), "--keyframes", At("bend.json"), "--axis", "coronal", "--out", At("x.nii.gz")});
  EXPECT_EQ(wrong.code, 3);
}

TEST_F(Products, FieldsStateTheirError) {
  const Ended ended = Run({"field", At("model"), "--joint", "lower.flexion=20", "--level", "1", "--out",
                           At("back.nrrd"), "--json"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  const json errors = json::parse(ended.out);
  EXPECT_GE(errors["largest_error_mm"], errors["p99_error_mm"]);
  EXPECT_LT(errors["mean_error_mm"], 1.0);
}

TEST_F(Products, AScansMapBackAndItsConfidence) {
  ExpectDone({"field", At("model"), "--scan", "pose01", "--inverse", "--out", At("inverse.nrrd")});
  EXPECT_EQ(Start("inverse.nrrd", 4), "NRRD");
  ExpectDone({"field", At("model"), "--scan", "pose01", "--forward", "--out", At("forward.nrrd")});
  ExpectDone({"field", At("model"), "--scan", "pose01", "--confidence", "--out", At("sure.nii.gz")});
  const Volume sure = ReadScan(At("sure.nii.gz")).volume;
  const auto [least, most] = std::minmax_element(sure.values.begin(), sure.values.end());
  EXPECT_EQ(*least, 0);
  EXPECT_GT(*most, 50);
  EXPECT_LE(*most, 100);
  ExpectDone({"field", At("model"), "--scan", "pose01", "--error", "--out", At("error.nrrd")});
  EXPECT_EQ(Start("error.nrrd", 4), "NRRD");
  EXPECT_EQ(
      Run({"field", At("model"), "--scan", "pose01", "--error", "--confidence", "--out", At("x.nrrd")}).code,
      2);
  const json info = json::parse(Run({"info", At("model"), "--json"}).out);
  EXPECT_GT(info["scans"][0]["confidence_percent"], 0);
  EXPECT_LE(info["scans"][0]["unsure_fraction"], 1);
  EXPECT_EQ(
      Run({"field", At("model"), "--joint", "lower.flexion=20", "--inverse", "--out", At("x.nrrd")}).code, 2);
}

// What reads NIfTI through ITK makes 0 of "not a number": as if nothing were better known.
TEST_F(Products, MapsWithUnknownPlacesWarnWhereTheyAreWrittenAsNifti) {
  const auto told = [](const char* map, const char* out) {
    const Ended ended = Run({"field", At("model"), "--scan", "pose01", map, "--out", At(out)});
    EXPECT_EQ(ended.code, 0) << ended.err;
    return ended.err;
  };
  for (const char* map : {"--error", "--inverse"}) {
    EXPECT_THAT(told(map, "unknown.nii.gz"), HasSubstr("0 mm")) << map;
    EXPECT_THAT(told(map, "unknown.NII"), HasSubstr("0 mm")) << map;
    EXPECT_EQ(told(map, "unknown.nrrd"), "") << map;
  }
  EXPECT_EQ(told("--confidence", "sure.nii"), "");
}

// Signals are ignored until the command asks for them; a second one ends it at once.
TEST_F(Products, AnInterruptedCommandLeavesNothing) {
  const auto handler = std::signal(SIGINT, SIG_IGN);
  const auto expect_interrupted = [](const std::vector<std::string>& arguments) {
    testing_support::Program program(scratch_->path(), arguments);
    while (program.Running()) {
      program.Signal(SIGINT);
      usleep(2000);
    }
    EXPECT_EQ(program.Wait().code, 130) << arguments[0];
    EXPECT_FALSE(std::filesystem::exists(arguments.back())) << arguments[0];
  };
  expect_interrupted(
      {"slice", At("model"), "--scan", "pose01", "--axis", "sagittal", "--out", At("none.png")});
  expect_interrupted({"slices", At("bones.nii.gz"), "--out", At("none.png")});
  expect_interrupted({"pose", At("model"), "--scan", "pose01", "--out", At("none.nrrd")});
  expect_interrupted({"field", At("model"), "--scan", "pose01", "--error", "--out", At("none.nrrd")});
  std::signal(SIGINT, handler);
}

TEST_F(Products, PointsGoThereAndBack) {
  std::ofstream(At("there.csv")) << "x,y,z\n0,0,10\n2,1,-12\n";
  ExpectDone({"map-points", At("model"), "--scan", "pose01", "--points", At("there.csv"), "--out",
              At("in_scan.csv")});
  ExpectDone({"map-points", At("model"), "--scan", "pose01", "--inverse", "--points", At("in_scan.csv"),
              "--out", At("back.csv")});
  std::ifstream file(At("back.csv"));
  std::string header;
  std::getline(file, header);
  for (const Eigen::Vector3d& expected : {Eigen::Vector3d(0, 0, 10), Eigen::Vector3d(2, 1, -12)}) {
    Eigen::Vector3d x;
    char comma;
    file >> x.x() >> comma >> x.y() >> comma >> x.z();
    EXPECT_LT((x - expected).norm(), 0.05);
  }
  std::ofstream(At("far.csv")) << "x,y,z\n900,0,0\n";
  const Ended far = Run({"map-points", At("model"), "--scan", "pose01", "--inverse", "--points",
                         At("far.csv"), "--out", At("far_out.csv")});
  EXPECT_EQ(far.code, 0);
  EXPECT_THAT(far.err, HasSubstr("nothing of the template"));
}

// The digest covers the bytes of all artefacts.
TEST_F(Products, OneThreadMakesTheSameModel) {
  ExpectDone({"build", At("study.json"), "--out", At("one"), "--threads", "1", "--quiet"});
  const auto digest = [](const std::string& model) {
    return json::parse(Run({"info", At(model), "--json"}).out)["digest"];
  };
  EXPECT_EQ(digest("one"), digest("model"));
}

TEST_F(Products, PlansCountEigenposesAndProposeAScan) {
  const Ended ended =
      Run({"plan-poses", At("model"), "--motion", At("bend.json"), "--propose", "1", "--json"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  const json plan = json::parse(ended.out);
  EXPECT_EQ(plan["eigenposes"], 1);
  ASSERT_EQ(plan["next"].size(), 1u);
  EXPECT_LE(plan["next"][0]["uncertainty_after"], plan["uncertainty"]);
}

TEST_F(Products, PlansWarnOfAnglesBeyondTheirLimits) {
  std::ofstream(At("far.json"))
      << R"({"fps":2,"frames":[{"time":0,"joints":{}},{"time":1,"joints":{"lower.flexion":170}}]})";
  const Ended ended = Run({"plan-poses", At("model"), "--motion", At("far.json")});
  ASSERT_EQ(ended.code, 0) << ended.err;
  EXPECT_THAT(ended.err, HasSubstr("lower.flexion = 170 is beyond"));
}

TEST_F(Products, PlansSayWhereNoPoseIsWorthAScan) {
  std::ofstream(At("still.json")) << R"({"fps":5,"frames":[{"time":0,"joints":{}},{"time":1,"joints":{}}]})";
  const Ended ended = Run({"plan-poses", At("model"), "--motion", At("still.json")});
  ASSERT_EQ(ended.code, 0) << ended.err;
  EXPECT_THAT(ended.out, HasSubstr("uncertainty now 0.00"));
  EXPECT_THAT(ended.out, HasSubstr("no pose of the motion would tell the model much"));
}

TEST_F(Products, TheExtrapolationMapIsZeroInsideTheExamples) {
  ExpectDone({"pose", At("model"), "--joint", "lower.flexion=300", "--out", At("far.nrrd"), "--level", "2",
              "--extrapolation-map", At("far_map.nrrd"), "--quiet"});
  ExpectDone({"pose", At("model"), "--scan", "pose01", "--out", At("near.nrrd"), "--level", "2",
              "--extrapolation-map", At("near_map.nrrd")});
  const Volume far = ReadScan(At("far_map.nrrd")).volume, near = ReadScan(At("near_map.nrrd")).volume;
  EXPECT_GT(*std::max_element(far.values.begin(), far.values.end()), 1.0f);
  EXPECT_EQ(*std::max_element(near.values.begin(), near.values.end()), 0.0f);
}

}  // namespace
}  // namespace kvx
