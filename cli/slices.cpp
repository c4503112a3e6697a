// kinevox slices: pictures of volumes, three planes each, for a quick look.
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/options/named_files.h"
#include "cli/terminal/interrupt.h"
#include "core/text/extension.h"
#include "pipeline/io/atomic_file.h"
#include "pipeline/io/volume_file.h"
#include "pipeline/pictures/slice_tiles.h"
#include "pipeline/scans/filled_corners.h"

namespace kvx {
namespace {

struct SlicesArguments {
  std::vector<std::filesystem::path> volumes;
  std::filesystem::path out;
};

void Run(const SlicesArguments& arguments, const CommandContext& context) {
  CatchInterrupts();
  if (!HasExtension(arguments.out, ".png")) throw InputError("--out must end in .png");
  RequireMayWrite(arguments.out);
  std::vector<Volume> volumes;
  for (const auto& path : arguments.volumes) {
    RequireReadableDicom(path, path.string());
    const Scan scan = FromFile(path, ReadScan);
    ThrowIfInterrupted();
    volumes.push_back(WithoutImpossibleFilling(scan.volume, scan.modality));
  }
  AtomicFile file(arguments.out);
  const Picture page = SliceMontage(volumes);
  WritePng(file.temporary(), page);
  file.Commit();
  if (!context.json) return;
  PrintDocument(
      nlohmann::ordered_json{{"volumes", volumes.size()}, {"width", page.width}, {"height", page.height}}
          .dump(1));
}

}  // namespace

void AddSlices(CLI::App& program, CommandContext& context) {
  CLI::App* command = program.add_subcommand("slices", "Draw three slices of each volume side by side");
  auto arguments = std::make_shared<SlicesArguments>();
  command->add_option("volumes", arguments->volumes, "Volume files")->required()->type_name("VOLUME");
  AddOut(*command, arguments->out, "The picture, .png");
  AddQuiet(*command, context);
  AddJson(*command, context);
  command->footer("Example:\n  kinevox slices flexion15.nii.gz flexion65.nii.gz --out poses.png");
  command->callback([arguments, &context] { Run(*arguments, context); });
}

}  // namespace kvx
