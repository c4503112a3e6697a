// The subcommands of `kinevox`: what they share, and one function each that adds one to the program.
#pragma once
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "core/errors.h"
#include "kernels/device/backend.h"

namespace CLI {
class App;
class Validator;
}  // namespace CLI

namespace kvx {

// What every subcommand is given. It outlives the parse; callbacks keep a reference.
struct CommandContext {
  bool json = false;       // --json: one JSON document on stdout
  bool quiet = false;      // --quiet: no progress on stderr
  BackendOptions backend;  // --device, --threads
};

// Exit codes of the program (contract).
enum ExitCode {
  kExitDone = 0,
  kExitUsage = 2,
  kExitInput = 3,
  kExitFailed = 4,
  kExitNotFound = 5,
  kExitRefused = 6,
  kExitInterrupted = 130
};

// A callback reports failure by throwing: InputError -> 3, NotFound -> 5, Refused -> 6, Cancelled and
// Interrupted -> 130, UsageError -> 2, anything else -> 4. main() prints it as one line, `kinevox: MESSAGE`.

// Permission or quota (HTTP 401, 403, 413, 429).
class Refused : public Error {
  using Error::Error;
};

// Stopped on request while something else goes on, which the sentence tells.
class Interrupted : public Error {
  using Error::Error;
};

// The command line contradicts itself.
class UsageError : public Error {
  using Error::Error;
};

void AddJson(CLI::App& command, CommandContext& context);              // --json
void AddQuiet(CLI::App& command, CommandContext& context);             // --quiet: no progress
void AddDevice(CLI::App& command, CommandContext& context);            // --device, --threads
void AddComputing(CLI::App& command, CommandContext& context);         // the three above
void AddModelFolder(CLI::App& command, std::filesystem::path& model);  // MODEL, must be given
// --out, must be given; `type` stands for its value in the help.
void AddOut(CLI::App& command, std::filesystem::path& out, const std::string& help,
            const std::string& type = "FILE");
void AddServer(CLI::App& command, std::string& url);           // --server, with the default in `url`
void AddData(CLI::App& command, std::filesystem::path& data);  // --data, with the default in `data`
void AddLevel(CLI::App& command, int& level);                  // --level of what is posed
void AddMode(CLI::App& command, std::string& mode);            // --mode

// Checks of numbers whose refusals can be read.
CLI::Validator AboveZero();
CLI::Validator ZeroOrAbove();
CLI::Validator AtMost(int64_t most);
// To be given to `transform`: a 0 in front does not make a number octal.
CLI::Validator WholeUpTo(uint64_t most);

// One JSON document and a line feed on stdout; throws Unavailable when it cannot be written.
void PrintDocument(std::string_view json);
// Throws Unavailable unless all that was printed on stdout has arrived.
void RequirePrinted();
// A line on stderr, `kinevox: warning: ...`.
void Warn(std::string_view sentence);
// What to do about a file or folder; the error's own words name paths.
std::string SentenceOf(const std::filesystem::filesystem_error& error);

void AddBuild(CLI::App& program, CommandContext& context);
void AddSegment(CLI::App& program, CommandContext& context);
void AddInfo(CLI::App& program, CommandContext& context);
void AddPose(CLI::App& program, CommandContext& context);
void AddSlice(CLI::App& program, CommandContext& context);
void AddSurface(CLI::App& program, CommandContext& context);
void AddAnimate(CLI::App& program, CommandContext& context);
void AddField(CLI::App& program, CommandContext& context);
void AddPlanPoses(CLI::App& program, CommandContext& context);
void AddMapPoints(CLI::App& program, CommandContext& context);
void AddEvaluate(CLI::App& program, CommandContext& context);
void AddPhantom(CLI::App& program, CommandContext& context);
void AddSlices(CLI::App& program, CommandContext& context);
void AddServe(CLI::App& program, CommandContext& context);
void AddSubmit(CLI::App& program, CommandContext& context);
void AddJobs(CLI::App& program, CommandContext& context);
void AddFetch(CLI::App& program, CommandContext& context);
void AddKeys(CLI::App& program, CommandContext& context);
void AddAudit(CLI::App& program, CommandContext& context);
void AddBackup(CLI::App& program, CommandContext& context);  // and restore
void AddCancel(CLI::App& program, CommandContext& context);
void AddWorker(CLI::App& program, CommandContext& context);
void AddCompletion(CLI::App& program, CommandContext& context);
void AddInspectUpload(CLI::App& program, CommandContext& context);

}  // namespace kvx
