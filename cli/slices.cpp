// kinevox slices: pictures of volumes, three planes each, for a quick look.
#include <CLI/CLI.hpp>

#include "cli/commands.h"
#include "cli/interrupt.h"
#include "cli/named_files.h"
#include "core/extension.h"
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

void Run(const SlicesArguments& arguments) {
  CatchInterrupts();
  if (!HasExtension(arguments.out, ".png")) throw InputError("--out must end in .png");
  std::vector<Volume> volumes;
  for (const auto& path : arguments.volumes) {
    RequireReadableDicom(path, path.string());
    const Scan scan = FromFile(path, ReadScan);
    ThrowIfInterrupted();
    volumes.push_back(WithoutImpossibleFilling(scan.volume, scan.modality));
  }
  AtomicFile file(arguments.out);
  WritePng(file.temporary(), SliceMontage(volumes));
  file.Commit();
}

}  // namespace

void AddSlices(CLI::App& program, CommandContext& context) {
  CLI::App* command = program.add_subcommand("slices", "Draw three slices of each volume side by side");
  auto arguments = std::make_shared<SlicesArguments>();
  command->add_option("volumes", arguments->volumes, "Volume files")->required()->type_name("VOLUME");
  command->add_option("--out", arguments->out, "The picture, .png")->required()->type_name("FILE");
  AddQuiet(*command, context);
  command->footer("Example:\n  kinevox slices flexion15.nii.gz flexion65.nii.gz --out poses.png");
  command->callback([arguments] { Run(*arguments); });
}

}  // namespace kvx
