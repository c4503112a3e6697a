// They say nothing to any other method.
#include "cli/options/paper_options.h"

#include <CLI/CLI.hpp>

#include "cli/commands.h"

namespace kvx {
namespace {

constexpr uint64_t kMost = 1'000'000'000;  // as the service takes

}  // namespace

void AddPaperOptions(CLI::App& command, PaperOptions& paper) {
  command
      .add_option("--max-blocks", paper.max_blocks,
                  "Method paper: register at most this many blocks per scan, worst first (0: all)")
      ->transform(WholeUpTo(kMost))
      ->type_name("N");
  command
      .add_option(
          "--max-seconds", paper.max_seconds,
          "Method paper: stop after this many seconds per scan (0: never). The result then depends on the "
          "machine, and is not found again by a later build")
      ->check(ZeroOrAbove())
      ->type_name("S");
  command.add_option("--seed", paper.seed, "Method paper: seed of the random restarts")
      ->transform(WholeUpTo(kMost))
      ->capture_default_str()
      ->type_name("N");
}

void RequirePaperMethod(const CLI::App& command, const std::string& method) {
  if (method == "paper") return;
  for (const char* name : {"--max-blocks", "--max-seconds", "--seed"}) {
    if (command.count(name) > 0) throw CLI::ValidationError(name, "belongs to --method paper");
  }
}

}  // namespace kvx
