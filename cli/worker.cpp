// kinevox worker: takes jobs from a service's data folder, beside the service.
#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>

#include "cli/commands.h"
#include "cli/service/data_folder_records.h"
#include "cli/terminal/open_files.h"
#include "cli/terminal/stop_on_interrupt.h"
#include "server/jobs/worker_process.h"
#include "server/log.h"

namespace kvx {
namespace {

struct WorkerArguments {
  std::filesystem::path data;
  std::string log = "info";
  int workers = 1;
  double lease_seconds = 15, memory_gib = 0, least_free_gib = 0.5;
};

void Run(const WorkerArguments& arguments, const CommandContext& context) {
  RequireDataFolder(arguments.data);
  WorkerProcessOptions options;
  options.data = arguments.data;
  options.workers = arguments.workers;
  options.lease_ms = int64_t(arguments.lease_seconds * 1000);
  options.memory_bytes = int64_t(arguments.memory_gib * double(int64_t(1) << 30));
  options.least_free_bytes = uintmax_t(arguments.least_free_gib * double(int64_t(1) << 30));
  options.backend = context.backend;
  SetLogLevel(context.quiet ? "error" : arguments.log);
  AllowManyOpenFiles();
  CatchInterrupts();
  std::signal(SIGPIPE, SIG_IGN);  // who reads the log may go at any time
  WorkerProcess worker(options);
  std::fprintf(stderr, "working\n");
  const StopOnInterrupt stopper([&worker] { worker.Stop(); });
  worker.Run();
}

// Within which it takes and holds a job.
void AddLimits(CLI::App& command, WorkerArguments& arguments) {
  command
      .add_option(
          "--memory-gib", arguments.memory_gib,
          "Memory that running jobs of all processes may declare together (default: most of the machine's)")
      ->check(ZeroOrAbove())
      ->check(AtMost(1'000'000'000))
      ->type_name("GIB");
  command
      .add_option("--least-free-gib", arguments.least_free_gib,
                  "No job is begun when less of the disk is free")
      ->check(CLI::Range(0.0, 1e6))
      ->capture_default_str()
      ->type_name("GIB");
  command
      .add_option("--lease-seconds", arguments.lease_seconds,
                  "A worker that is silent this long has lost its job")
      ->check(CLI::Range(0.5, 3600.0))
      ->capture_default_str()
      ->type_name("S");
}

}  // namespace

void AddWorker(CLI::App& program, CommandContext& context) {
  CLI::App* command =
      program.add_subcommand("worker", "Run jobs of a service as another process on its data folder");
  auto arguments = std::make_shared<WorkerArguments>();
  AddData(*command, arguments->data);
  command->add_option("--workers", arguments->workers, "Jobs at the same time")
      ->check(CLI::Range(1, 64))
      ->capture_default_str()
      ->type_name("N");
  AddLimits(*command, *arguments);
  command->add_option("--log", arguments->log, "What is logged on stderr")
      ->check(CLI::IsMember({"info", "warn", "error", "off"}))
      ->capture_default_str();
  AddDevice(*command, context);
  command->add_flag("--quiet", context.quiet, "As --log error");
  command->footer(
      "Start the service first: it makes the data folder. Then start any number of them beside 'kinevox "
      "serve', on the same machine (in containers, too): on another one it is refused, as leases go by the "
      "machine's own clock, and so is one of another version. With 'serve --workers 0' the service itself "
      "computes no models: a crash of an OpenCL driver then costs a job an attempt and the service nothing. "
      "A job whose workers die three times has failed. SIGTERM gives running jobs back.\n\n"
      "Examples:\n  kinevox serve --data /srv/kinevox --workers 0 &\n  kinevox worker --data /srv/kinevox");
  command->callback([arguments, &context] { Run(*arguments, context); });
}

}  // namespace kvx
