// kinevox backup, kinevox restore: a copy of the data folder of a running service, and the way back.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "api/request.h"
#include "cli/commands.h"
#include "cli/terminal/interrupt.h"
#include "cli/terminal/progress_bar.h"
#include "core/errors.h"
#include "core/text/listed.h"
#include "storage/backup.h"

namespace kvx {
namespace {

struct BackupArguments {
  std::filesystem::path data, other;
  bool check = false, incomplete = false;
};

void Print(const BackupFigures& figures, const CommandContext& context) {
  if (context.json)
    return PrintDocument(
        Dump(Json{{"files", figures.files}, {"bytes", figures.bytes}, {"lost", figures.lost}}));
  std::printf("%lld files copied, %.1f MiB\n", static_cast<long long>(figures.files),
              double(figures.bytes) / (1 << 20));
}

template <class Copy>
BackupFigures Run(const Copy& copy, const CommandContext& context) {
  CatchInterrupts();
  ProgressBar bar(context.quiet);
  const BackupFigures figures = copy(bar.AsProgress());
  bar.Finish();
  Print(figures, context);
  return figures;
}

void AddBackupAlone(CLI::App& program, CommandContext& context) {
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
    const BackupFigures figures = Run(back_up, context);
    if (figures.lost.empty()) return;
    throw Unavailable(
        "the copy is made, without what is lost or damaged in the data folder: " + Listed(figures.lost) +
        "; upload or build them again and repeat this, or see whether an older backup has them");
  });
  backup->footer(
      "Posed volumes and unfinished uploads are left out.\n\n"
      "Example:\n  kinevox backup --data /srv/kinevox --out /backup/kinevox");
  AddQuiet(*backup, context);
  AddJson(*backup, context);
}

void AddRestore(CLI::App& program, CommandContext& context) {
  auto arguments = std::make_shared<BackupArguments>();
  CLI::App* restore = program.add_subcommand("restore", "Check a backup and make a data folder of it");
  restore->add_option("--from", arguments->other, "Folder that 'kinevox backup' made")
      ->required()
      ->type_name("DIR");
  restore->add_option("--data", arguments->data, "The data folder to make; empty or not there")
      ->capture_default_str()
      ->type_name("DIR");
  restore->add_flag(
      "--incomplete", arguments->incomplete,
      "Restore the rest where uploads or models are lost or damaged in the backup; they are named");
  restore->callback([arguments, &context] {
    const Lost lost = arguments->incomplete ? Lost::kLeftOut : Lost::kRefused;
    const auto restore_it = [&](const Progress& p) {
      return Restore(arguments->other, arguments->data, lost, p);
    };
    const BackupFigures figures = Run(restore_it, context);
    if (!figures.lost.empty())
      Warn("restored without " + Listed(figures.lost) + "; upload or build them again");
  });
  restore->footer("Example:\n  kinevox restore --from /backup/kinevox --data /srv/kinevox-new");
  AddQuiet(*restore, context);
  AddJson(*restore, context);
}

}  // namespace

void AddBackup(CLI::App& program, CommandContext& context) {
  AddBackupAlone(program, context);
  AddRestore(program, context);
}

}  // namespace kvx
