// kinevox inspect-upload: for the service itself,
// which reads what it is sent in a process that may die (server/ports/child_inspector.h).
#include <CLI/CLI.hpp>

#include "cli/commands.h"
#include "server/ports/child_inspector.h"

namespace kvx {

void AddInspectUpload(CLI::App& program, CommandContext&) {
  struct Arguments {
    std::string kind, region = "custom";
    std::filesystem::path file;
  };
  CLI::App* command = program.add_subcommand("inspect-upload", "")->group("");  // an empty group hides it
  auto arguments = std::make_shared<Arguments>();
  command->add_option("kind", arguments->kind)->required()->check(CLI::IsMember({"scan", "labels"}));
  command->add_option("file", arguments->file)->required();
  command->add_option("region", arguments->region);
  command->callback([arguments] {
    PrintDocument(InspectInThisProcess(arguments->kind, arguments->file, arguments->region, {}));
  });
}

}  // namespace kvx
