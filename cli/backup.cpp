// kinevox backup, kinevox restore: a copy of the data folder of a running service, and the way back.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "api/request.h"
#include "cli/commands.h"
#include "cli/terminal/interrupt.h"
#include "cli/terminal/progress_bar.h"
#include "storage/backup.h"

namespace kvx {
namespace {

struct BackupArguments {
  std::filesystem::path data, other;
  bool check = false;
};

void Print(const BackupFigures& figures, const CommandContext& context) {
  if (context.json) return PrintDocument(Dump(Json{{"files", figures.files}, {"bytes", figures.bytes}}));
  std::printf("%lld files copied, %.1f MiB\n", static_cast<long long>(figures.files),
              double(figures.bytes) / (1 << 20));
}

template <class Copy>
void Run(const Copy& copy, const CommandContext& context) {
  CatchInterrupts();
  ProgressBar bar(context.quiet);
  const BackupFigures figures = copy(bar.AsProgress());
  bar.Finish();
  Print(figures, context);
}

}  // namespace

void AddBackup(CLI::App& program, CommandContext& context) {
  auto arguments = std::make_shared<BackupArguments>();
  CLI::App* backup = program.add_subcommand("backup", "Copy a data folder while the service runs");
  AddData(*backup, arguments->data);
  backup
      ->add_option("--out", arguments->other,
                   "Folder of the copy: new, empty, or an older copy of it, which is brought up to date")
      ->required()
      ->type_name("DIR");
  backup->add_flag("--check", arguments->check,
                   "Read all of an older copy too, and mend what is damaged there");
  backup->callback([arguments, &context] {
    const CopiedBefore before = arguments->check ? CopiedBefore::kChecked : CopiedBefore::kTrusted;
    const auto back_up = [&](const Progress& p) {
      return BackUp(arguments->data, arguments->other, before, p);
    };
    Run(back_up, context);
  });
  backup->footer(
      "Posed volumes and unfinished uploads are left out.\n\n"
      "Example:\n  kinevox backup --data /srv/kinevox --out /backup/kinevox");
  CLI::App* restore = program.add_subcommand("restore", "Check a backup and make a data folder of it");
  restore->add_option("--from", arguments->other, "Folder that 'kinevox backup' made")
      ->required()
      ->type_name("DIR");
  restore->add_option("--data", arguments->data, "The data folder to make; empty or not there")
      ->capture_default_str()
      ->type_name("DIR");
  restore->callback([arguments, &context] {
    Run([&](const Progress& p) { return Restore(arguments->other, arguments->data, p); }, context);
  });
  restore->footer("Example:\n  kinevox restore --from /backup/kinevox --data /srv/kinevox-new");
  for (CLI::App* one : {backup, restore}) {
    AddQuiet(*one, context);
    AddJson(*one, context);
  }
}

}  // namespace kvx
