// A tiny study through the real program: build, info, pose, map-points, evaluate; killed, interrupted and
// repeated builds.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <set>

#include "core/text/points_csv.h"
#include "pipeline/io/volume_file.h"
#include "tests/support/fixtures.h"
#include "tests/support/hinge_study.h"
#include "tests/support/program.h"

namespace kvx {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing_support::Content;
using testing_support::Ended;
using testing_support::Hinge;
using testing_support::Program;
using testing_support::RunProgram;
using testing_support::ScratchFolder;

class EndToEnd : public testing::Test {
 protected:
  static void SetUpTestSuite() {
    scratch_ = new ScratchFolder;
    testing_support::WriteHingeStudy(scratch_->path());
    built_ = new Ended(Run({"build", At("study.json"), "--out", At("model"), "--json"}));
  }
  static void TearDownTestSuite() {
    delete built_;
    delete scratch_;
  }
  static std::string At(const std::string& name) { return (scratch_->path() / name).string(); }
  static Ended Run(const std::vector<std::string>& arguments) {
    return RunProgram(scratch_->path(), arguments);
  }
  static std::string DigestOf(const std::string& model) {
    return json::parse(Run({"info", At(model), "--json"}).out)["digest"];
  }
  static bool HasArtefacts(const std::string& model, int at_least) {
    std::error_code ended;  // folders come and go while the build runs
    int count = 0;
    std::filesystem::recursive_directory_iterator entry(At(model) + "/artifacts", ended), last;
    for (; !ended && entry != last; entry.increment(ended)) count += entry->path().extension() == ".kva";
    return count >= at_least;
  }
  // Starts a build and sends `signal` once some stages are finished.
  static Ended StoppedBuild(const std::string& model, int signal) {
    Program build(scratch_->path(), {"build", At("study.json"), "--out", At(model)});
    while (build.Running() && !HasArtefacts(model, 9)) usleep(5000);
    build.Signal(signal);
    return build.Wait();
  }
  static ScratchFolder* scratch_;
  static Ended* built_;
};
ScratchFolder* EndToEnd::scratch_ = nullptr;
Ended* EndToEnd::built_ = nullptr;

TEST_F(EndToEnd, BuildPrintsOneDocumentAndProgressElsewhere) {
  ASSERT_EQ(built_->code, 0) << built_->err;
  EXPECT_EQ(json::parse(built_->out)["name"], "hinge");
  EXPECT_THAT(built_->err, HasSubstr("register pose02"));
  EXPECT_THAT(built_->err, testing::Not(HasSubstr("\r"))) << "a bar was drawn although stderr is no terminal";
}

TEST_F(EndToEnd, InfoIsTheSameDocumentAndReadableWithoutJson) {
  EXPECT_EQ(Run({"info", At("model"), "--json"}).out, built_->out);
  EXPECT_THAT(Run({"info", At("model")}).out, HasSubstr("lower.flexion"));
}

TEST_F(EndToEnd, AFinishedBuildIsFoundAgain) {
  const Ended again = Run({"build", At("study.json"), "--out", At("model"), "--json", "--quiet"});
  EXPECT_EQ(again.code, 0);
  EXPECT_EQ(again.out, built_->out);
  EXPECT_EQ(again.err, "");
}

TEST_F(EndToEnd, AKilledBuildGoesOnToTheSameModel) {
  EXPECT_EQ(StoppedBuild("killed", SIGKILL).code, 128 + SIGKILL);
  EXPECT_FALSE(std::filesystem::exists(At("killed/model.json")));
  ASSERT_EQ(Run({"build", At("study.json"), "--out", At("killed"), "--quiet", "--threads", "1"}).code, 0);
  EXPECT_EQ(DigestOf("killed"), DigestOf("model"));
  ASSERT_EQ(Run({"pose", At("killed"), "--scan", "pose02", "--out", At("killed.nrrd")}).code, 0);
  ASSERT_EQ(Run({"pose", At("model"), "--scan", "pose02", "--out", At("first.nrrd")}).code, 0);
  EXPECT_EQ(Content(At("killed.nrrd")), Content(At("first.nrrd")));
}

TEST_F(EndToEnd, AnInterruptedBuildSaysSo) {
  const Ended ended = StoppedBuild("interrupted", SIGINT);
  EXPECT_EQ(ended.code, 130);
  EXPECT_THAT(ended.err, HasSubstr("kinevox: interrupted"));
}

TEST_F(EndToEnd, PosesAVolumeThatResemblesTheScan) {
  ASSERT_EQ(Run({"pose", At("model"), "--scan", "pose01", "--out", At("p.nii.gz")}).code, 0);
  const Scan posed = ReadScan(At("p.nii.gz")), scan = ReadScan(At("pose01.nii.gz"));
  EXPECT_EQ(posed.stored_as, ScalarType::kUint8);
  double difference = 0, spread = 0;
  int counted = 0;
  for (size_t v = 0; v < scan.volume.values.size(); ++v) {
    const PointVox p =
        posed.volume.grid.ToVox(scan.volume.grid.ToMm(PointVox{scan.volume.grid.Ijk(v).cast<double>()}));
    if (scan.volume.values[v] < 40 || !posed.volume.grid.Contains(p)) continue;
    difference += std::abs(SampleTrilinear(posed.volume, p) - scan.volume.values[v]);
    spread += std::abs(scan.volume.values[v] - 115);
    ++counted;
  }
  ASSERT_GT(counted, 10000);
  EXPECT_LT(difference, 0.6 * spread) << "mean difference " << difference / counted;
}

TEST_F(EndToEnd, PosesByEveryMode) {
  std::map<std::string, Volume> posed;
  for (const std::string mode : {"vbd", "evd", "elastic"}) {
    ASSERT_EQ(
        Run({"pose", At("model"), "--joint", "lower.flexion=60", "--mode", mode, "--out", At(mode + ".nrrd")})
            .code,
        0);
    posed[mode] = ReadScan(At(mode + ".nrrd")).volume;
  }
  EXPECT_NE(posed["elastic"].values, posed["evd"].values);
  EXPECT_NE(posed["elastic"].values, posed["vbd"].values);
  const Ended ended =
      Run({"pose", At("model"), "--joint", "lower.flexion=60", "--mode", "soft", "--out", At("x.nrrd")});
  EXPECT_EQ(ended.code, 2);
  EXPECT_THAT(ended.err, HasSubstr("elastic"));
}

TEST_F(EndToEnd, PosesLabelsInEveryFormat) {
  for (const char* name : {"l.nii", "l.nii.gz", "l.nrrd", "l.mha", "l.mhd"}) {
    ASSERT_EQ(Run({"pose", At("model"), "--joint", "lower.flexion=5", "--label", "--out", At(name)}).code, 0)
        << name;
    const LabelMap labels = ReadLabels(At(name));
    EXPECT_EQ(std::set<uint16_t>(labels.values.begin(), labels.values.end()), (std::set<uint16_t>{0, 1, 2}))
        << name;
  }
}

TEST_F(EndToEnd, JointsBeyondTheirLimitsAreWarnedOf) {
  const Ended ended =
      Run({"pose", At("model"), "--joint", "lower.flexion=70", "--level", "1", "--out", At("far.nrrd")});
  EXPECT_EQ(ended.code, 0) << ended.err;
  EXPECT_THAT(ended.err, HasSubstr("kinevox: warning: lower.flexion"));
  EXPECT_THAT(ended.err, HasSubstr("extrapolates"));
}

TEST_F(EndToEnd, BonesAndMotionsBeyondTheirLimitsAreWarnedOf) {
  json bones;
  bones["scan_from_template"]["lower"] = RowMajor(Hinge::ScanFromLower({.flexion_rad = RadFromDeg(70)}));
  std::ofstream(At("far.json")) << bones;
  json frames;
  for (const double flexion : {0, 60, 70, 65}) {
    const double time_s = 0.5 * double(frames["frames"].size());
    frames["frames"].push_back({{"time", time_s}, {"joints", {{"lower.flexion", flexion}}}});
  }
  frames["frames"].push_back({{"time", 2}, {"scan", "pose01"}});
  frames["fps"] = 1;
  std::ofstream(At("far_frames.json")) << frames;
  const Ended posed =
      Run({"pose", At("model"), "--pose", At("far.json"), "--level", "1", "--out", At("far_bones.nrrd")});
  const Ended moved = Run({"animate", At("model"), "--keyframes", At("far_frames.json"), "--level", "1",
                           "--out", At("far_frames"), "--quiet"});
  for (const Ended& ended : {posed, moved}) {
    EXPECT_EQ(ended.code, 0) << ended.err;
    EXPECT_THAT(ended.err,
                testing::ContainsRegex("kinevox: warning: lower.flexion = (69|70)[.0-9]* is beyond"));
    EXPECT_THAT(ended.err, HasSubstr("extrapolates"));
    EXPECT_EQ(ended.err.find("warning"), ended.err.rfind("warning")) << ended.err;
  }
  frames["frames"].erase(1), frames["frames"].erase(1), frames["frames"].erase(1);
  std::ofstream(At("near_frames.json")) << frames;
  EXPECT_EQ(Run({"animate", At("model"), "--keyframes", At("near_frames.json"), "--level", "1", "--out",
                 At("near_frames"), "--quiet"})
                .err,
            "");
}

TEST_F(EndToEnd, WhoAsksForAScanThatDoesNotBelongIsTold) {
  Volume flipped = ReadScan(At("pose01.nii.gz")).volume;
  std::ranges::reverse(flipped.values);
  WriteVolume(At("flipped.nii.gz"), flipped, ScalarType::kUint8);
  json study = json::parse(Content(At("study.json")));
  study["scans"].push_back({{"name", "flipped"}, {"volume", "flipped.nii.gz"}});
  std::ofstream(At("odd.json")) << study;
  const Ended built = Run({"build", At("odd.json"), "--out", At("odd"), "--quiet"});
  ASSERT_EQ(built.code, 0);
  EXPECT_THAT(built.out, HasSubstr("some of them side by side")) << "sums of stages are no time on a clock";
  std::ofstream(At("one.csv")) << "x,y,z\n0,0,0\n";
  const std::vector<std::vector<std::string>> commands{
      {"pose", At("odd"), "--level", "1", "--out", At("odd.nrrd")},
      {"map-points", At("odd"), "--points", At("one.csv"), "--out", At("mapped.csv")},
      {"field", At("odd"), "--confidence", "--out", At("sure.nrrd")}};
  for (std::vector<std::string> words : commands) {
    words.insert(words.end(), {"--scan", "flipped"});
    const Ended ended = Run(words);
    EXPECT_EQ(ended.code, 0) << ended.err;
    EXPECT_THAT(ended.err, HasSubstr("kinevox: warning: scan 'flipped': the scan shows mirror images"))
        << words[0];
    words.back() = "pose01";
    EXPECT_THAT(Run(words).err, testing::Not(HasSubstr("warning"))) << words[0];
  }
}

TEST_F(EndToEnd, UnknownNamesAreNotFoundAndListed) {
  const Ended joint = Run({"pose", At("model"), "--joint", "lower.twist=5", "--out", At("x.nrrd")});
  EXPECT_EQ(joint.code, 5);
  EXPECT_THAT(joint.err, HasSubstr("lower.flexion"));
  const Ended scan = Run({"pose", At("model"), "--scan", "pose77", "--out", At("x.nrrd")});
  EXPECT_EQ(scan.code, 5);
  EXPECT_THAT(scan.err, HasSubstr("pose01"));
  EXPECT_FALSE(std::filesystem::exists(At("x.nrrd")));
}

TEST_F(EndToEnd, MapsPointsInOrderWithTheirColumns) {
  const testing_support::HingePose truth = testing_support::HingePoses()[1];
  std::ofstream(At("in.csv")) << "x,y,z,id\n-2,1,-18,\"lower, bone\"\n2,1,18,upper\n9,8,15,\n";
  ASSERT_EQ(
      Run({"map-points", At("model"), "--scan", "pose01", "--points", At("in.csv"), "--out", At("out.csv")})
          .code,
      0);
  const PointTable in = ParsePoints(Content(At("in.csv"))), out = ParsePoints(Content(At("out.csv")));
  EXPECT_EQ(out.extra_header, ",id");
  EXPECT_EQ(out.extra, in.extra);
  ASSERT_EQ(out.points.size(), 3u);
  for (size_t i = 0; i < 3; ++i) {
    EXPECT_LT((out.points[i].lps - Hinge::Moved(in.points[i], truth).lps).norm(), 1.2) << i;
  }
}

TEST_F(EndToEnd, AngleZeroIsTheTemplate) {
  std::ofstream(At("still.csv")) << "x,y,z\n-2,1,-18\n9,8,15\n";
  ASSERT_EQ(Run({"map-points", At("model"), "--joint", "lower.flexion=0", "--points", At("still.csv"),
                 "--out", At("same.csv")})
                .code,
            0);
  const PointTable in = ParsePoints(Content(At("still.csv"))), out = ParsePoints(Content(At("same.csv")));
  for (size_t i = 0; i < 2; ++i) EXPECT_LT((out.points[i].lps - in.points[i].lps).norm(), 0.05);
}

TEST_F(EndToEnd, EvaluatesWithPictures) {
  const Ended ended =
      Run({"evaluate", At("model"), "--pictures", At("pictures"), "--leave-one-out", "--json"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  const json document = json::parse(ended.out);
  EXPECT_LT(document["mean"]["register"]["ssd"], document["mean"]["source"]["ssd"]);
  ASSERT_EQ(document["table"].size(), 3u);
  EXPECT_EQ(document["table"][2]["volume"], "register");
  EXPECT_EQ(document["table"][2]["ssd"], document["mean"]["register"]["ssd"]);
  EXPECT_EQ(document["leave_one_out"].size(), 2u);
  for (const char* name : {"pictures/pose01.png", "pictures/pose02.png"}) {
    EXPECT_EQ(Content(At(name)).substr(1, 3), "PNG") << name;
  }
  EXPECT_THAT(Run({"evaluate", At("model")}).out, HasSubstr("mean of 2"));
}

// Tables take minutes; pictures are beside them.
TEST_F(EndToEnd, PicturesThatCannotBeWrittenDoNotCostTheTables) {
  std::ofstream(At("no_folder")) << "a file";
  const Ended refused = Run({"evaluate", At("model"), "--pictures", At("no_folder")});
  EXPECT_EQ(refused.code, 3);
  EXPECT_EQ(refused.out, "") << "before any work";
  EXPECT_THAT(refused.err, HasSubstr(At("no_folder")));
  std::filesystem::create_directories(At("blocked/pose02.png"));
  const Ended late = Run({"evaluate", At("model"), "--pictures", At("blocked")});
  EXPECT_EQ(late.code, 3);
  EXPECT_THAT(late.out, HasSubstr("mean of 2"));
  EXPECT_THAT(late.err, HasSubstr(At("blocked") + ": "));
  EXPECT_EQ(Content(At("blocked/pose01.png")).substr(1, 3), "PNG");
}

TEST_F(EndToEnd, AForeignFolderIsNotTouched) {
  std::filesystem::create_directories(At("precious"));
  std::ofstream(At("precious/thesis.txt")) << "years of work";
  EXPECT_EQ(Run({"build", At("study.json"), "--out", At("precious"), "--quiet"}).code, 3);
  EXPECT_EQ(Content(At("precious/thesis.txt")), "years of work");
}

}  // namespace
}  // namespace kvx
