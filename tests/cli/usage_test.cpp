// Help, version, wrong usage and exit codes of the real program.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <fstream>
#include <sstream>

#include "tests/support/fixtures.h"
#include "tests/support/program.h"

namespace kvx {
namespace {

using testing::HasSubstr;
using testing::StartsWith;
using testing_support::Ended;
using testing_support::RunProgram;
using testing_support::ScratchFolder;

constexpr int kUsage = 2, kInput = 3, kFailed = 4, kNotFound = 5;

// Lines of a help text that are wider than a terminal.
std::string WideLines(const std::string& help) {
  std::istringstream lines(help);
  std::string wide;
  for (std::string line; std::getline(lines, line);)
    if (line.size() > 100) wide += line + "\n";
  return wide;
}

class Usage : public testing::Test {
 protected:
  Ended Run(const std::vector<std::string>& arguments) { return RunProgram(scratch_.path(), arguments); }
  std::string File(const std::string& name, const std::string& text = {}) {
    const auto path = scratch_.path() / name;
    if (!text.empty()) std::ofstream(path) << text;
    return path.string();
  }
  // One line on stderr, ours, and nothing on stdout.
  void ExpectFailure(const Ended& ended, int code) {
    EXPECT_EQ(ended.code, code) << ended.err;
    EXPECT_EQ(ended.out, "");
    EXPECT_THAT(ended.err, StartsWith("kinevox: "));
    EXPECT_EQ(std::count(ended.err.begin(), ended.err.end(), '\n'), 1) << ended.err;
  }
  ScratchFolder scratch_;
};

TEST_F(Usage, EverySubcommandHasHelpWithAnExample) {
  // The names that the completion script offers first, those of options among them
  const std::string script = Run({"completion", "bash"}).out;
  const size_t begin = script.find("plain=\"", script.find("\n    \"\") plain=")) + 7;
  std::istringstream words(script.substr(begin, script.find('"', begin) - begin));
  const std::string all = Run({"--help"}).out;
  int commands = 0;
  for (std::string name; words >> name;) {
    if (name.starts_with("--")) continue;
    ++commands;
    EXPECT_THAT(all, HasSubstr(name));
    const Ended help = Run({name, "--help"});
    EXPECT_EQ(help.code, 0) << name;
    EXPECT_THAT(help.out, HasSubstr("Example")) << name;
    EXPECT_THAT(help.out, HasSubstr("kinevox " + name)) << name;
    EXPECT_EQ(help.err, "") << name;
    // One prints a script, one nothing, one has subcommands that do.
    const bool answers = name != "completion" && name != "worker" && name != "keys";
    EXPECT_EQ(help.out.find("--json") != std::string::npos, answers) << name;
    EXPECT_EQ(WideLines(help.out), "") << name;
  }
  EXPECT_EQ(WideLines(all), "");
  EXPECT_GE(commands, 22);
}

// Scripts say it to all of them.
TEST_F(Usage, WhatMayTakeLongTakesQuiet) {
  for (const char* name : {"plan-poses", "slices", "info", "jobs", "cancel", "backup", "restore", "field"})
    EXPECT_THAT(Run({name, "--help"}).out, HasSubstr("--quiet")) << name;
}

TEST_F(Usage, VersionIsOneLineOnStdout) {
  const Ended ended = Run({"--version"});
  EXPECT_EQ(ended.code, 0);
  EXPECT_THAT(ended.out, testing::MatchesRegex("kinevox [0-9]+\\.[0-9]+\\.[0-9]+\n"));
}

TEST_F(Usage, HelpThatCannotBePrintedIsAFailure) {
  for (const char* words : {"--version", "--help", "pose --help"}) {
    const std::string line = std::string(KVX_PROGRAM) + " " + words + " > /dev/full 2> " + File("err");
    EXPECT_EQ(WEXITSTATUS(std::system(line.c_str())), kFailed) << words;
  }
}

TEST_F(Usage, WrongCommandLinesAreUsageErrors) {
  const std::string out = File("o.nii.gz");
  const std::vector<std::vector<std::string>> wrong{
      {},
      {"explode"},
      {"build"},
      {"build", "study.json"},
      {"build", "study.json", "--out", "m", "--method", "guess"},
      {"build", "study.json", "--out", "m", "--threads", "0"},
      {"build", "study.json", "--out", "m", "--threads", "two"},
      {"segment", File("scan.nii", "never read"), "--threshold", "high", "--out", out},
      {"segment", File("scan.nii", "never read"), "--threshold", "nan", "--out", out},
      {"info"},
      {"pose", "m", "--out", out},
      {"pose", "m", "--joint", "tibia.flexion=3", "--scan", "pose01", "--out", out},
      {"pose", "m", "--joint", "tibia.flexion=3", "--mode", "magic", "--out", out},
      {"pose", "m", "--joint", "tibia.flexion", "--out", out},
      {"pose", "m", "--joint", "tibia.flexion=many", "--out", out},
      {"pose", "m", "--joint", "tibia.flexion=3,5", "--out", out},
      {"pose", "m", "--joint", "tibia.flexion=1", "--joint", "tibia.flexion=2", "--out", out},
      {"slice", "m", "--joint", "a.b=1", "--slab-mm", "5", "--out", File("o.png")},
      {"animate", "m", "--keyframes", "k.json", "--slab-mm", "5", "--out", out},
      {"map-points", "m", "--joint", "a.b=1", "--stage", "register", "--points", "p", "--out", "o"},
      {"phantom", "elbow", "--out", "d"},
      {"phantom", "knee"},
      {"phantom", "knee", "--out", "d", "--scale", "double"},
  };
  for (const auto& arguments : wrong) {
    SCOPED_TRACE(testing::PrintToString(arguments));
    ExpectFailure(Run(arguments), kUsage);
  }
}

TEST_F(Usage, BothStrokesAndAThresholdAreOneTooMany) {
  const std::string scan = File("scan.nii", "never read"), seeds = File("seeds.nii", "never read");
  const Ended both =
      Run({"segment", scan, "--seeds", seeds, "--threshold", "auto", "--out", File("o.nii.gz")});
  ExpectFailure(both, kUsage);
  EXPECT_THAT(both.err, HasSubstr("give one of --seeds and --threshold"));
}

// The template's labels would have stood where another scan was.
TEST_F(Usage, SegmentTakesTheLabelsToNoScanOfTheStudy) {
  for (const char* file : {"rest.nii", "bent.nii", "strokes.nii"}) File(file, "never read");
  const std::string study = File("study.json", R"({"name": "s", "region": "knee", "template": "rest",
      "scans": [{"name": "rest", "volume": "rest.nii"}, {"name": "bent", "volume": "bent.nii"}],
      "bones": {"seeds": "strokes.nii"}})");
  const Ended ended = Run({"segment", study, "--out", File("bent.nii", "never read")});
  ExpectFailure(ended, kUsage);
  EXPECT_THAT(ended.err, HasSubstr("would take the place of a scan of the study"));
}

TEST_F(Usage, ASeedIsAWholeNumberThatIsKept) {
  for (const char* seed : {"-1", "18446744073709551616", "1e3", "1.5", "0x10", "seven", "+1"}) {
    const Ended ended = Run({"phantom", "knee", "--out", File("d"), "--seed", seed});
    ExpectFailure(ended, kUsage);
    EXPECT_THAT(ended.err, HasSubstr("from 0 to 18446744073709551615")) << seed;
  }
  for (const char* option : {"--seed", "--max-blocks"}) {
    for (const char* number : {"9223372036854775808", "1000000001", "-1"}) {
      const Ended ended = Run({"build", "s.json", "--out", "m", "--method", "paper", option, number});
      ExpectFailure(ended, kUsage);
      EXPECT_THAT(ended.err, HasSubstr("from 0 to 1000000000")) << option << " " << number;
    }
  }
}

// As of a script whose variable is not set: the template would have been written for a scan.
TEST_F(Usage, AnEmptyValueIsNotTheDefault) {
  const std::string out = File("o.nii.gz");
  const std::vector<std::vector<std::string>> wrong{
      {"pose", "m", "--scan", "", "--out", out},
      {"pose", "m", "--pose", "", "--out", out},
      {"pose", "m", "--scan", "a", "--out", ""},
      {"pose", "", "--scan", "a", "--out", out},
      {"build", "s.json", "--out", "m", "--artifacts", ""},
      {"segment", "s.nii", "--seeds", "t.nii", "--previous", "", "--out", out},
      {"evaluate", "m", "--truth", ""},
      {"serve", "--config", "", "--print-config"},
      {"jobs", ""},
      {"fetch", "mdl_1", "--scan", "", "--out", out},
      {"keys", "revoke", ""},
      {"audit", "verify", "--head", ""},
  };
  for (const auto& arguments : wrong) {
    SCOPED_TRACE(testing::PrintToString(arguments));
    const Ended ended = Run(arguments);
    ExpectFailure(ended, kUsage);
    EXPECT_THAT(ended.err, HasSubstr("is empty"));
  }
}

TEST_F(Usage, AnEndingChoosesTheFormatInAnyCase) {
  const auto refused = [&](const char* command, const char* out) {
    return Run({command, File("no.model"), "--joint", "a.b=1", "--out", File(out)});
  };
  for (const char* out : {"o.NII.GZ", "o.Nrrd", "o.Mha", "o.ZIP"})
    ExpectFailure(refused("pose", out), kNotFound);
  for (const char* out : {"o.PNG", "o.NII"}) ExpectFailure(refused("slice", out), kNotFound);
  for (const char* out : {"o.GLB", "o.Stl"}) ExpectFailure(refused("surface", out), kNotFound);
  ExpectFailure(Run({"slices", File("no.nii"), "--out", File("o.PNG")}), kNotFound);
  const std::string motion =
      File("k.JSON", R"({"frames": [{"time": 0, "joints": {}}, {"time": 1, "joints": {}}]})");
  for (const char* out : {"o.NII.GZ", "o.MP4", "o.Gif"})
    ExpectFailure(Run({"animate", File("no.model"), "--keyframes", motion, "--out", File(out)}), kNotFound);
  const Ended fetched =
      Run({"fetch", "m", "--server", "http://127.0.0.1:1", "--joint", "a.b=1", "--out", File("o.NII.GZ")});
  ExpectFailure(fetched, kFailed);
  for (const char* command : {"pose", "slice", "fetch"}) {
    const Ended ended = refused(command, "o.txt");
    ExpectFailure(ended, kInput);
    EXPECT_THAT(ended.err, HasSubstr(".nii.gz")) << command;
  }
}

TEST_F(Usage, AnUnknownSubcommandIsNamed) {
  EXPECT_THAT(Run({"explode"}).err, HasSubstr("'explode'"));
  EXPECT_THAT(Run({"keys", "lose"}).err, HasSubstr("'lose'; see 'kinevox keys --help'"));
  EXPECT_EQ(Run({"keys", "lose"}).code, kUsage);
}

TEST_F(Usage, ANumberOutOfRangeIsRefusedInAShortSentence) {
  const Ended ended = Run({"keys", "add", "--name", "a", "--days", "-1"});
  ExpectFailure(ended, kUsage);
  EXPECT_THAT(ended.err, HasSubstr("--days"));
  EXPECT_THAT(ended.err, HasSubstr("above 0"));
  EXPECT_LT(ended.err.size(), 120u);
  for (const char* option : {"--days", "--gib-per-day"}) {
    const Ended much = Run({"keys", "add", "--name", "a", option, "1e30"});
    ExpectFailure(much, kUsage);
    EXPECT_THAT(much.err, HasSubstr("must be at most"));
  }
}

TEST_F(Usage, NestedSubcommandsHaveExamples) {
  for (const auto& command : std::vector<std::vector<std::string>>{
           {"keys", "add"}, {"keys", "list"}, {"keys", "revoke"}, {"audit", "list"}, {"audit", "verify"}}) {
    EXPECT_THAT(Run({command[0], command[1], "--help"}).out,
                HasSubstr("kinevox " + command[0] + " " + command[1]));
  }
}

TEST_F(Usage, WhatIsNotThereIsNotFound) {
  ExpectFailure(Run({"info", File("no-model")}), kNotFound);
  ExpectFailure(Run({"info", File("no-model"), "--json"}), kNotFound);
  ExpectFailure(Run({"evaluate", File("no-model")}), kNotFound);
  ExpectFailure(Run({"pose", File("no-model"), "--scan", "a", "--out", File("o.nii")}), kNotFound);
}

TEST_F(Usage, AnAnimationsFolderMayHaveADotInItsName) {
  const std::string bend = File("bend.csv", "time,tibia.flexion\n0,0\n1,20\n");
  const auto run = [&](const std::string& out) {
    return Run({"animate", File("no-model"), "--keyframes", bend, "--out", out});
  };
  for (const char* folder : {"bend_v0.5", "bend.final", "2026.11.26"})
    ExpectFailure(run(File(folder)), kNotFound);  // the model: the name is a folder's
  for (const char* file : {"bend.nrrd", "bend.avi", "bend.mp3"}) ExpectFailure(run(File(file)), kInput);
  std::filesystem::create_directory(File("bend.old"));
  ExpectFailure(run(File("bend.old")), kNotFound);
}

TEST_F(Usage, ABoneThatAStudyMisspellsIsToldWithTheStudysFile) {
  File("p.nii", "never read");
  const std::string study = File("study.json", R"({"name": "a", "region": "knee", "template": "p",
      "scans": [{"name": "p", "volume": "p.nii"}], "bones": {"labels": "p.nii"},
      "initial_poses": {"p": {"tib": [1,0,0,0, 0,1,0,0, 0,0,1,0, 0,0,0,1]}}})");
  const Ended ended = Run({"build", study, "--out", File("m"), "--quiet"});
  ExpectFailure(ended, kInput);
  EXPECT_THAT(ended.err, HasSubstr("study.json: initial_poses.p.tib names a bone"));
}

TEST_F(Usage, APoseFileWithFieldsThatNobodyReadsIsRefused) {
  const Ended ended = Run({"pose", File("m"), "--pose", File("pose.json", R"({"scan": "a", "mode": "vbd"})"),
                           "--out", File("o.nii")});
  ExpectFailure(ended, kInput);
  EXPECT_THAT(ended.err, HasSubstr("'mode'"));
}

TEST_F(Usage, AnAddressOfAServiceHasNoPath) {
  for (const char* url :
       {"http://127.0.0.1:1/prefix", "http://127.0.0.1:1//", "http://127.0.0.1:1?a=b", "127.0.0.1:1"}) {
    const Ended ended = Run({"jobs", "--server", url});
    ExpectFailure(ended, kUsage);
    EXPECT_THAT(ended.err, HasSubstr("without a path"));
  }
  EXPECT_EQ(Run({"jobs", "--server", "http://127.0.0.1:1/"}).code, 4) << "nobody listens there";
}

TEST_F(Usage, WhereNothingCanBeWrittenIsToldBeforeAnythingIsRead) {
  const std::string scan = File("s.nii", "damaged"), out = File("no/o.png");
  for (const std::vector<std::string>& words :
       {std::vector<std::string>{"slices", scan}, {"slice", File("no.model"), "--scan", "a"}}) {
    std::vector<std::string> all = words;
    all.insert(all.end(), {"--out", out});
    const Ended ended = Run(all);
    ExpectFailure(ended, kInput);
    EXPECT_THAT(ended.err, HasSubstr("lie in does not exist")) << words[0];
  }
}

TEST_F(Usage, AnInterruptedPhantomDoesNotSayThatItGoesOn) {
  testing_support::Program phantom(scratch_.path(), {"phantom", "knee", "--out", File("phantom")});
  while (phantom.Running() && !std::filesystem::exists(File(".phantom.partial"))) usleep(5000);
  phantom.Signal(SIGINT);
  const Ended ended = phantom.Wait();
  EXPECT_EQ(ended.code, 130);
  EXPECT_THAT(ended.err, HasSubstr("kinevox: interrupted"));
  EXPECT_THAT(ended.err, testing::Not(HasSubstr("finished stage")));
}

TEST_F(Usage, BadFilesAreInputErrors) {
  ExpectFailure(Run({"build", File("study.json", "{\"name\": "), "--out", File("m"), "--quiet"}), kInput);
  ExpectFailure(Run({"pose", File("m"), "--scan", "a", "--out", File("o.jpg")}), kInput);
  ExpectFailure(Run({"map-points", File("m"), "--scan", "a", "--points", File("p.csv", "a,b\n"), "--out",
                     File("o.csv")}),
                kInput);
  ExpectFailure(Run({"pose", File("m"), "--pose", File("pose.json", "[]"), "--out", File("o.nii")}), kInput);
}

}  // namespace
}  // namespace kvx
