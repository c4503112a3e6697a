// Options that change what a command does, each against the same command without it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <fstream>
#include <nlohmann/json.hpp>
#include <thread>

#include "tests/support/hinge_study.h"
#include "tests/support/program_test.h"
#include "tests/support/served.h"

namespace kvx {
namespace {

using nlohmann::json;
using testing::HasSubstr;
using testing_support::Content;
using testing_support::Ended;

TEST(ServeOptions, OverruleTheirSettings) {
  const testing_support::ScratchFolder scratch;
  const std::tuple<std::vector<std::string>, const char*> cases[] = {
      {{"--data", "there"}, "data = 'there'"},
      {{"--listen", "[::1]:7"}, "listen = '[::1]:7'"},
      {{"--workers", "3"}, "workers = 3"},
      {{"--result-cache-gib", "2.5"}, "result_cache_gib = 2.5"},
      {{"--upload-limit-gib", "1.5"}, "upload_gib = 1.5"},
      {{"--memory-gib", "7"}, "memory_gib = 7.0"},
      {{"--lease-seconds", "20"}, "lease_seconds = 20.0"},
      {{"--private-webhooks"}, "private_addresses = true"},
      {{"--tls-certificate", "c.pem"}, "certificate = 'c.pem'"},
      {{"--tls-key", "k.pem"}, "key = 'k.pem'"},
      {{"--log", "warn"}, "log = 'warn'"},
      {{"--device", "H100"}, "name = 'H100'"},
      {{"--threads", "5"}, "threads = 5"},
  };
  const std::string usual = testing_support::RunProgram(scratch.path(), {"serve", "--print-config"}).out;
  std::vector<std::string> all{"serve", "--print-config"};
  for (const auto& [words, line] : cases) {
    EXPECT_EQ(usual.find(line), usual.npos) << line << " is the default";
    all.insert(all.end(), words.begin(), words.end());
  }
  const Ended ended = testing_support::RunProgram(scratch.path(), all);
  ASSERT_EQ(ended.code, 0) << ended.err;
  for (const auto& [words, line] : cases)
    EXPECT_THAT(ended.out, HasSubstr("\n" + std::string(line) + "  #")) << words[0];
}

class ModelOptions : public testing_support::ProgramTest {
 protected:
  static void SetUpTestSuite() {
    built_ = new testing_support::ScratchFolder;
    testing_support::WriteHingeStudy(built_->path());
    const Ended ended =
        testing_support::RunProgram(built_->path(), {"build", Study(), "--out", Built(), "--quiet"});
    ASSERT_EQ(ended.code, 0) << ended.err;
  }
  static void TearDownTestSuite() { delete built_; }
  static std::string Study() { return (built_->path() / "study.json").string(); }
  static std::string Built() { return (built_->path() / "model").string(); }
  // What a command writes with these words after its own.
  std::string Written(const std::vector<std::string>& command, const std::vector<std::string>& more,
                      const std::string& out) {
    std::vector<std::string> words{command[0], Built()};
    words.insert(words.end(), command.begin() + 1, command.end());
    words.insert(words.end(), more.begin(), more.end());
    words.insert(words.end(), {"--out", At(out), "--quiet"});
    const Ended ended = Run(words);
    EXPECT_EQ(ended.code, 0) << ended.err;
    return Content(At(out));
  }
  // A model of the study, from the stages that are there.
  Ended Build(const std::vector<std::string>& more) {
    std::vector<std::string> words{"build", Study(), "--out", At("m"), "--quiet"};
    words.insert(words.end(), more.begin(), more.end());
    return Run(words);
  }
  static testing_support::ScratchFolder* built_;
};
testing_support::ScratchFolder* ModelOptions::built_ = nullptr;

// Between the examples, where pose space decides.
TEST_F(ModelOptions, SpaceAndBasisChangeWhatIsPosed) {
  std::ofstream(At("p.csv")) << "x,y,z\n9,8,15\n-9,7,-4\n8,-9,1\n";
  const std::vector<std::string> bent{"--joint", "lower.flexion=13"};
  const std::tuple<std::vector<std::string>, const char*> commands[] = {
      {{"map-points", "--points", At("p.csv")}, "o.csv"},
      {{"pose"}, "o.nrrd"},
      {{"slice", "--axis", "sagittal"}, "s.nrrd"},
      {{"surface", "--skin"}, "o.stl"},
      {{"field"}, "f.nrrd"},
  };
  for (const auto& [words, out] : commands) {
    SCOPED_TRACE(words[0]);
    std::vector<std::string> command = words;
    command.insert(command.end(), bent.begin(), bent.end());
    const std::string usual = Written(command, {}, out);
    EXPECT_EQ(Written(command, {"--space", "local", "--basis", "rbf"}, out), usual) << "the defaults";
    EXPECT_NE(Written(command, {"--space", "global"}, out), usual);
    EXPECT_NE(Written(command, {"--basis", "normalised"}, out), usual);
  }
}

TEST_F(ModelOptions, APoseSpaceIsRefusedWhereAScansPointsGoWithoutOne) {
  std::ofstream(At("p.csv")) << "x,y,z\n0,0,10\n";
  const std::vector<std::string> map{"map-points", "--scan", "pose01", "--points", At("p.csv")};
  const std::vector<std::string> spaces[] = {{"--space", "global"}, {"--basis", "normalised"}};
  for (const std::vector<std::string>& space : spaces) {
    std::vector<std::string> words{map[0], Built(), "--out", At("o.csv")};
    words.insert(words.end(), map.begin() + 1, map.end());
    words.insert(words.end(), space.begin(), space.end());
    const Ended refused = Run(words);
    EXPECT_EQ(refused.code, 2) << space[0];
    EXPECT_THAT(refused.err, HasSubstr("add --mode"));
    Written(map, {space[0], space[1], "--mode", "evd"}, "o.csv");
  }
}

TEST_F(ModelOptions, SurfacesAreAsSmoothAndFineAsAsked) {
  const auto surface = [&](const std::vector<std::string>& more) {
    std::vector<std::string> words{"surface", Built(), "--scan", "pose01",
                                   "--bone",  "upper", "--out",  At("s.stl")};
    words.insert(words.end(), more.begin(), more.end());
    return RunJson(words)["surfaces"][0];
  };
  const json usual = surface({}), full = surface({"--largest-error", "0"}),
             rough = surface({"--largest-error", "0", "--smoothing", "0"});
  EXPECT_GT(full["triangles"], 2 * usual["triangles"].get<int>());
  EXPECT_GT(rough["area_mm2"], full["area_mm2"]) << "steps between voxels";
}

// The rate of a file that says none.
TEST_F(ModelOptions, FpsSaysHowManyFramesASecondHas) {
  std::ofstream(At("k.json"))
      << R"({"frames": [{"time": 0, "joints": {}}, {"time": 0.5, "joints": {"lower.flexion": 30}}]})";
  const auto frames = [&](const char* fps) {
    return RunJson({"animate", Built(), "--keyframes", At("k.json"), "--fps", fps, "--level", "3", "--out",
                    At("a.nii.gz"), "--quiet"});
  };
  EXPECT_EQ(frames("8"), (json{{"frames", 5}, {"fps", 8.0}}));
  EXPECT_EQ(frames("4"), (json{{"frames", 3}, {"fps", 4.0}}));
}

TEST_F(ModelOptions, ABuildRunsOnTheDeviceAndKeepsStagesWhereItIsTold) {
  const Ended nowhere = Build({"--device", "no such device"});
  EXPECT_EQ(nowhere.code, 4);
  EXPECT_THAT(nowhere.err, HasSubstr("'no such device'; there are: 0: "));
  const std::string stages = Built() + "/artifacts";
  const Ended ended = Build({"--device", "0", "--artifacts", stages});
  EXPECT_EQ(ended.code, 0) << ended.err;
  EXPECT_FALSE(std::filesystem::exists(At("m/artifacts")));
  EXPECT_EQ(RunJson({"info", At("m")})["digest"], RunJson({"info", Built()})["digest"]);
}

TEST_F(ModelOptions, StagesThatHaveNoFolderAreRefusedBeforeTheBuild) {
  std::ofstream(At("file")) << "text";
  for (const std::string& stages : {At("file"), At("file/stages")}) {
    const Ended ended = Build({"--artifacts", stages});
    EXPECT_EQ(ended.code, 3) << ended.err;
    EXPECT_THAT(ended.err, HasSubstr("--artifacts: " + stages + " cannot be made a folder"));
    EXPECT_FALSE(std::filesystem::exists(At("m")));
  }
}

// A shell command where folders may be mounted, seen by nobody else; its messages go to `said`.
int InNamespace(const std::string& command, const std::string& said) {
  return std::system(("unshare -rm sh -c '" + command + "' 2>" + said).c_str());
}

TEST_F(ModelOptions, AFolderThatMayNotBeWrittenIsRefusedBeforeTheBuild) {
  std::filesystem::create_directory(At("m"));
  const std::string mount =
      "mount --bind " + At("m") + " " + At("m") + " && mount -o remount,bind,ro " + At("m");
  if (InNamespace(mount, At("said")) != 0)
    GTEST_SKIP() << "this user may not mount in a namespace of its own";
  const std::string build =
      " && " KVX_PROGRAM " build " + Study() + " --artifacts " + At("stages") + " --out ";
  EXPECT_EQ(WEXITSTATUS(InNamespace(mount + build + At("m"), At("said"))), 6);
  EXPECT_THAT(Content(At("said")), HasSubstr("nothing may be written into the output folder"));
  EXPECT_TRUE(std::filesystem::is_empty(At("stages"))) << "no stage was begun";
}

TEST_F(ModelOptions, WhereAnAnimationCannotBeWrittenIsToldBeforeItsFramesArePosed) {
  std::ofstream(At("k.json")) << R"({"frames": [{"time": 0, "joints": {}}, {"time": 1, "joints": {}}]})";
  std::ofstream(At("file")) << "text";
  for (const std::string& out : {At("no/a.nii.gz"), At("file/frames")}) {
    const Ended ended = Run({"animate", Built(), "--keyframes", At("k.json"), "--out", out});
    EXPECT_NE(ended.code, 0) << out;
    EXPECT_THAT(ended.err, testing::Not(HasSubstr("%"))) << "no step of the work";
  }
}

// PoCL would end the program at the first kernel.
TEST_F(ModelOptions, ADeviceThatCannotLoadItsKernelsIsRefused) {
  std::filesystem::create_directory(At("cache"));
  const auto in_namespace = [&](const std::string& command) {
    return InNamespace("mount -t tmpfs -o noexec none " + At("cache") + " && " + command, At("said"));
  };
  if (in_namespace("true") != 0) GTEST_SKIP() << "this user may not mount a tmpfs in a namespace of its own";
  const std::string program = "POCL_CACHE_DIR=" + At("cache/pocl") + " " KVX_PROGRAM " ";
  for (const std::string& command :
       {"serve --listen 127.0.0.1:0 --device pthread --data " + At("data"),
        "worker --device pthread --data " + At("data"),
        "pose " + Built() + " --scan pose01 --device pthread --out " + At("p.nii")}) {
    EXPECT_EQ(WEXITSTATUS(in_namespace(program + command)), 4) << command;
    EXPECT_THAT(Content(At("said")), HasSubstr("noexec")) << command;
  }
}

TEST_F(ModelOptions, InfoTellsWhatTheScansShowAndTheControlPointsOfEachLevel) {
  const std::string told = Run({"info", Built()}).out;
  EXPECT_THAT(told, testing::ContainsRegex("lower.flexion +-[0-9.]+ .. +[0-9.]+ \\(-?[0-9.]+ .. [0-9.]+\\)"));
  const json scan = RunJson({"info", Built()})["scans"][0];
  std::string levels;
  for (const json& points : scan["control_points_per_level"])
    levels += (levels.empty() ? "" : " + ") + points.dump();
  EXPECT_THAT(told, HasSubstr("control points: " + scan["control_points"].dump() + ", from coarse to fine " +
                              levels + "\n"));
}

// A block has eight control points.
TEST_F(ModelOptions, ThePapersMethodStopsWhereItIsTold) {
  const std::string stages = Built() + "/artifacts";
  const Ended blocks = Build({"--method", "paper", "--max-blocks", "3", "--artifacts", stages});
  ASSERT_EQ(blocks.code, 0) << blocks.err;
  EXPECT_THAT(blocks.err, HasSubstr("the registration was limited"));
  EXPECT_THAT(blocks.err, testing::Not(HasSubstr("a limit in seconds")));
  EXPECT_THAT(blocks.err,
              testing::Not(HasSubstr("where tissue went is not sure")));  // it states no confidence
  const json info = RunJson({"info", At("m")});
  EXPECT_THAT(info["warnings"].dump(), HasSubstr("the registration was limited"))
      << "who gets the model later";
  for (const json& scan : info["scans"]) {
    EXPECT_EQ(scan["control_points"], 24);
    EXPECT_EQ(scan["confidence_percent"], nullptr);
  }
  EXPECT_THAT(Run({"info", At("m")}).out, testing::Not(HasSubstr("confidence")));
  const Ended seconds = Build({"--method", "paper", "--max-seconds", "0.01", "--artifacts", stages});
  EXPECT_THAT(seconds.err, HasSubstr("a limit in seconds"));
  EXPECT_EQ(Build({"--max-blocks", "3"}).code, 2) << "of the other method";
}

// A service that leaves its jobs to others, and one study there.
class QueueOptions : public testing_support::ProgramTest {
 protected:
  QueueOptions() {
    std::filesystem::create_directory(At("study"));
    study_ = testing_support::WriteHingeStudy(At("study")).string();
  }
  json Submit(const std::vector<std::string>& more = {}) {
    std::vector<std::string> words{"submit", study_, "--server", server_.url(), "--quiet"};
    words.insert(words.end(), more.begin(), more.end());
    return RunJson(words);
  }
  json Job(const json& sent) { return RunJson({"jobs", sent["job"], "--server", server_.url()}); }
  std::string StateOf(const json& sent) { return Job(sent)["state"]; }
  // States of two jobs when a worker with these options has had time to take them.
  std::pair<std::string, std::string> AfterWorker(const std::vector<std::string>& more, const json& first,
                                                  const json& second, bool until_first_runs) {
    std::vector<std::string> words{"worker", "--data", At("data"), "--workers", "2"};
    words.insert(words.end(), more.begin(), more.end());
    testing_support::Program worker(scratch.path(), words);
    const auto look = [] { std::this_thread::sleep_for(std::chrono::milliseconds(250)); };
    while (until_first_runs && StateOf(first) == "queued" && worker.Running()) look();
    for (int looks = until_first_runs ? 2 : 8; looks > 0; --looks) look();
    const std::pair states(StateOf(first), StateOf(second));
    worker.Signal(SIGTERM);
    EXPECT_THAT(worker.Wait().err, HasSubstr("working"));
    return states;
  }
  std::string study_;
  testing_support::Served server_{scratch.path() / "data", {"--workers", "0"}};
};

TEST_F(QueueOptions, APriorityIsTheJobs) {
  EXPECT_EQ(Job(Submit())["priority"], 0);
  const json first = Submit({"--again", "--priority", "7"});
  EXPECT_EQ(Job(first)["priority"], 7);
  EXPECT_EQ(Job(first)["queue_position"], 1) << "before what came earlier";
}

TEST_F(QueueOptions, CancelEndsTheJobThatIsNamed) {
  const json sent = Submit();
  EXPECT_EQ(Run({"jobs", "--cancel", "--server", server_.url()}).code, 2) << "which?";
  EXPECT_EQ(Job(sent)["state"], "queued");
  EXPECT_EQ(RunJson({"jobs", sent["job"], "--cancel", "--server", server_.url()})["state"], "cancelled");
  EXPECT_EQ(Job(sent)["state"], "cancelled");
}

// A job that declares more than all memory runs, but alone.
TEST_F(QueueOptions, WorkersKeepToTheDiskAndMemoryThatTheyAreGiven) {
  const json first = Submit({"--priority", "1"}), second = Submit({"--again"});
  EXPECT_EQ(AfterWorker({"--least-free-gib", "1000000"}, first, second, false),
            (std::pair<std::string, std::string>("queued", "queued")));
  EXPECT_EQ(AfterWorker({"--memory-gib", "0.001"}, first, second, true).second, "queued");
  EXPECT_NE(AfterWorker({"--memory-gib", "64"}, first, second, true).second, "queued");
  EXPECT_EQ(Run({"worker", "--data", "none", "--memory-gib", "1e30"}).code, 2) << "no number of bytes";
}

TEST_F(QueueOptions, ACheckedBackupFindsOtherBytesOfTheSameSize) {
  Submit();
  const std::vector<std::string> backup{"backup", "--data", At("data"), "--out", At("copy")};
  ASSERT_EQ(Run(backup).code, 0);
  std::filesystem::path blob;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(At("copy/blobs")))
    if (entry.is_regular_file()) blob = entry.path();
  ASSERT_FALSE(blob.empty());
  const std::string bytes = Content(blob);
  std::ofstream(blob, std::ios::in | std::ios::binary) << char(bytes[0] ^ 1);
  EXPECT_EQ(Run(backup).code, 0);
  EXPECT_NE(Content(blob), bytes);
  std::vector<std::string> checked = backup;
  checked.push_back("--check");
  EXPECT_EQ(Run(checked).code, 0);
  EXPECT_EQ(Content(blob), bytes);
}

}  // namespace
}  // namespace kvx
