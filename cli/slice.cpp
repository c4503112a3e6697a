// kinevox slice: one posed slice in any plane, or a projection, without the posed volume.
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "api/poser_port.h"
#include "cli/commands.h"
#include "cli/options/named_files.h"
#include "cli/options/pose_options.h"
#include "cli/options/slice_options.h"
#include "cli/terminal/interrupt.h"
#include "cli/terminal/kept_memory.h"
#include "core/text/extension.h"
#include "pipeline/io/atomic_file.h"
#include "pipeline/io/volume_file.h"
#include "pipeline/posing/animation.h"

namespace kvx {
namespace {

struct SliceArguments {
  std::filesystem::path model, out;
  PoseOptions pose;
  SliceOptions slice;
};

// As the headers of a slice over HTTP.
std::string Document(const Grid& layer, ScalarType type,
                     const std::optional<std::pair<double, double>>& window) {
  return nlohmann::ordered_json::parse(SliceHeader(layer, type, window)).dump(1);
}

Volume Posed(const PosingEngine& engine, const ResolvedPose& pose, const SliceRequest& plane) try {
  const Grid room = engine.FittedGrid(pose);
  WarnOfPlane(plane, room);
  return PosedSlice(engine, pose, plane, room);
} catch (const InputError& error) {
  throw InputError(WithOptionNames(error.what()));
}

void Run(const SliceArguments& arguments, const CommandContext& context) {
  KeepFreedMemory(kBlocksOfAProduct);
  CatchInterrupts();
  RequireVolumeOr(".png", "a picture; for values", arguments.out);
  if (!HasExtension(arguments.out, ".png") && !arguments.slice.window.empty())
    throw UsageError("--window is of pictures: an --out that ends in .png");
  const SliceRequest plane = arguments.slice.Request();
  RequireFitting(plane);
  RequireMayWrite(arguments.out);
  const auto [model, pose] = LoadPosed(arguments.pose, arguments.model);
  Backend backend(context.backend);
  const Volume slice = Posed(*model.MakeEngine(backend), pose, plane);
  ThrowIfInterrupted();
  if (HasExtension(arguments.out, ".png")) {
    AtomicFile file(arguments.out);
    const Window window = ShownWindow(plane, slice, WindowOf(model.template_scan().volume));
    WritePng(file.temporary(), PictureOf(slice, window));
    file.Commit();
    const std::pair<double, double> shown(window.low, window.high);
    if (context.json) PrintDocument(Document(slice.grid, ScalarType::kUint8, shown));
    return;
  }
  const ScalarType type = model.template_scan().stored_as;
  WriteVolume(arguments.out, slice, type);
  if (context.json) PrintDocument(Document(slice.grid, type, {}));
}

}  // namespace

void AddSlice(CLI::App& program, CommandContext& context) {
  CLI::App* command = program.add_subcommand("slice", "Write one posed slice or projection");
  auto arguments = std::make_shared<SliceArguments>();
  AddPosedModel(*command, arguments->model, arguments->pose);
  AddSliceOptions(*command, arguments->slice);
  AddOut(*command, arguments->out,
         "A picture (.png), or the slice as a volume of one layer (.nii.gz, .nrrd, ...)");
  AddComputing(*command, context);
  command->footer(
      "Examples:\n  kinevox slice knee.model --joint tibia.flexion=35 --axis sagittal --out bent.png\n"
      "  kinevox slice hand.model --pose fist.json --axis coronal --projection max --out fist.png\n"
      "  kinevox slice knee.model --scan pose02 --centre 0,0,0 --right 1,0,0 --down 0,1,-1 --out "
      "cut.png");
  command->callback([arguments, &context] { Run(*arguments, context); });
}

}  // namespace kvx
