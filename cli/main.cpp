// kinevox: one program, one file per subcommand. Errors end here, as one line and an exit code.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <new>

#include "cli/commands.h"
#include "cli/options/help_format.h"
#include "cli/terminal/interrupt.h"
#include "cli/terminal/standard_streams.h"
#include "core/version.h"

namespace {

using namespace kvx;

int Fail(ExitCode code, std::string sentence) {
  std::string line;
  for (const char c : sentence) {
    const bool blank = c == '\n' || c == '\r' || c == ' ';
    if (!blank)
      line += c;
    else if (!line.empty() && line.back() != ' ')
      line += ' ';
  }
  std::fprintf(stderr, "kinevox: %s\n", line.c_str());
  return code;
}

int ParseFailure(const CLI::App& program, const CLI::ParseError& error) {
  if (error.get_exit_code() == int(CLI::ExitCodes::Success)) {  // help or version was asked for
    program.exit(error);
    RequirePrinted();
    return kExitDone;
  }
  const auto used = program.get_subcommands();
  const std::string help =
      used.empty() ? "kinevox --help" : "kinevox " + used.front()->get_name() + " --help";
  return Fail(kExitUsage, std::string(error.what()) + "; see '" + help + "'");
}

// CLI11 would only say that a subcommand is missing.
void RequireKnownCommands(const CLI::App& program, int count, char** arguments) {
  const CLI::App* command = &program;
  for (int i = 1; i < count && arguments[i][0] != '-'; ++i) {
    const auto named = [&](const CLI::App* part) { return part->get_name() == arguments[i]; };
    const bool takes_one = command->get_require_subcommand_min() > 0;
    const auto found = command->get_subcommands(named);
    if (!takes_one) return;
    if (found.empty()) {
      const std::string help = command == &program ? "" : " " + command->get_name();
      throw UsageError("there is no subcommand '" + std::string(arguments[i]) + "'; see 'kinevox" + help +
                       " --help'");
    }
    command = found.front();
  }
}

// How to take up again what was interrupted.
std::string Interruption(const CLI::App& program) {
  if (program.got_subcommand("build"))
    return "interrupted; run the same command again to go on from the last finished stage";
  if (program.got_subcommand("submit") && program.get_subcommand("submit")->count("--again") > 0)
    return "interrupted; run the same command again to start anew: bytes that have arrived are not sent "
           "again";
  if (program.got_subcommand("submit"))
    return "interrupted; run the same command again to go on: what has arrived is not sent again";
  if (program.got_subcommand("backup"))
    return "interrupted; run the same command again to go on: what has been copied is not copied again";
  if (program.got_subcommand("restore"))
    return "interrupted; remove what it left in the data folder, then run the same command again";
  return "interrupted; run the same command again to start anew";
}

// A script's variable that is not set would mean the default of whatever it was given to.
void RefuseEmptyValues(CLI::App& command) {
  const CLI::Validator filled(
      [](std::string& text) { return text.empty() ? "is empty; give a value, or leave it out" : ""; }, "",
      "");
  for (CLI::Option* option : command.get_options())
    if (option->get_items_expected_max() > 0) option->check(filled);
  for (CLI::App* part : command.get_subcommands([](CLI::App*) { return true; })) RefuseEmptyValues(*part);
}

int Parse(CLI::App& program, int count, char** arguments) try {
  RequireKnownCommands(program, count, arguments);
  program.parse(count, arguments);
  RequirePrinted();
  return kExitDone;
} catch (const CLI::ParseError& error) {
  return ParseFailure(program, error);
}

int Run(CLI::App& program, int count, char** arguments) {
  try {
    return Parse(program, count, arguments);
  } catch (const UsageError& error) {
    return Fail(kExitUsage, error.what());
  } catch (const InputError& error) {
    return Fail(kExitInput, error.what());
  } catch (const NotFound& error) {
    return Fail(kExitNotFound, error.what());
  } catch (const Denied& error) {
    return Fail(kExitRefused, error.what());
  } catch (const Refused& error) {
    return Fail(kExitRefused, error.what());
  } catch (const Interrupted& error) {
    return Fail(kExitInterrupted, error.what());
  } catch (const Cancelled&) {
    return Fail(kExitInterrupted, Interruption(program));
  } catch (const Error& error) {
    return Fail(kExitFailed, error.what());
  } catch (const std::filesystem::filesystem_error& error) {
    return Fail(IsDenial(error.code()) ? kExitRefused : kExitFailed, SentenceOf(error));
  } catch (const cl::Error& error) {
    return Fail(kExitFailed, DescribeFailure(error));
  } catch (const std::bad_alloc&) {
    return Fail(kExitFailed, "there is not enough memory for these volumes");
  } catch (const std::exception& error) {
    return Fail(InterruptRequested() ? kExitInterrupted : kExitFailed,
                std::string("processing failed: ") + error.what());
  }
}

}  // namespace

int main(int count, char** arguments) {
  HoldStandardStreams();
  CommandContext context;
  CLI::App program{"Kinevox: several scans of one person's hand or knee become one model that can be posed.",
                   "kinevox"};
  program.set_version_flag("--version", std::string("kinevox ") + ProgramVersion());
  program.require_subcommand(1);
  program.formatter(std::make_shared<HelpFormat>());
  AddPhantom(program, context);
  AddSegment(program, context);
  AddBuild(program, context);
  AddInfo(program, context);
  AddPose(program, context);
  AddSlice(program, context);
  AddSurface(program, context);
  AddAnimate(program, context);
  AddField(program, context);
  AddPlanPoses(program, context);
  AddMapPoints(program, context);
  AddEvaluate(program, context);
  AddSlices(program, context);
  AddServe(program, context);
  AddSubmit(program, context);
  AddJobs(program, context);
  AddFetch(program, context);
  AddKeys(program, context);
  AddAudit(program, context);
  AddBackup(program, context);
  AddCancel(program, context);
  AddWorker(program, context);
  AddCompletion(program, context);
  AddInspectUpload(program, context);
  RefuseEmptyValues(program);
  program.footer(
      "Every subcommand has --help with examples. Exit codes: 0 done, 2 usage, 3 input, 4 failed, 5 not "
      "found, 6 refused, 130 interrupted.");
  return Run(program, count, arguments);
}
