// kinevox animate: key frames or recorded motion to volumes, pictures or video.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/options/motion_options.h"
#include "cli/options/pose_options.h"
#include "cli/options/slice_options.h"
#include "cli/terminal/interrupt.h"
#include "cli/terminal/kept_memory.h"
#include "cli/terminal/progress_bar.h"
#include "core/text/extension.h"
#include "pipeline/io/sequence_file.h"
#include "pipeline/io/video_file.h"
#include "pipeline/model/model.h"
#include "pipeline/posing/animation.h"

namespace kvx {
namespace {

struct AnimateArguments {
  std::filesystem::path model, out;
  MotionOptions motion;
  SliceOptions view;
  std::string mode = "evd";
};

struct Target {
  bool video = false, one_file = false, pictures = false;
};

// Ends as formats do (.nrrd, .avi): a dot, a letter and at most three more letters or digits. "motion_v0.5"
// is a folder, and so is what is one already.
bool NamesAFormat(const std::filesystem::path& out) {
  const std::string extension = out.extension().string();
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); };
  const auto is_plain = [&](char c) { return is_letter(c) || (c >= '0' && c <= '9'); };
  std::error_code ignored;
  return extension.size() >= 2 && extension.size() <= 5 && is_letter(extension[1]) &&
         std::all_of(extension.begin() + 1, extension.end(), is_plain) &&
         !std::filesystem::is_directory(out, ignored);
}

Target TargetOf(const std::filesystem::path& out, const SliceRequest& view) {
  Target target;
  target.video = IsVideoName(out);
  target.one_file = HasExtension(out, ".nii") || HasExtension(out, ".nii.gz");
  target.pictures = target.video || view.NamesPlane();
  if (target.one_file && target.pictures)
    throw InputError(
        "a .nii file holds volumes; leave --axis and --projection out, or write a video or a folder");
  if (!target.pictures && !view.Empty())
    throw UsageError("--slab-mm, --window and sizes are of pictures; give --axis or --projection too");
  if (!target.video && !target.one_file && NamesAFormat(out))
    throw InputError("--out is a folder, a 4-D .nii or .nii.gz file, or a video (.mp4, .mkv, .webm, .gif)");
  if (target.pictures) RequireFitting(view.OfVideo());
  return target;
}

struct ShownRoom {
  const Grid grid;
  const Window window;
};

void WritePictures(const PosingEngine& engine, const Motion& motion, const KeyFrames& frames,
                   const ShownRoom& room, const SliceRequest& view, FrameSink<GreyPicture>& sink,
                   const Progress& progress) try {
  WarnOfPlane(view, room.grid);
  AnimatePictures(engine, motion, frames, room.grid, view, room.window, sink, progress);
} catch (const InputError& error) {
  throw InputError(WithOptionNames(error.what()));
}

void Run(const AnimateArguments& arguments, const CommandContext& context) {
  KeepFreedMemory(kBlocksOfAProduct);
  CatchInterrupts();
  const SliceRequest view = arguments.view.Request();
  const Target target = TargetOf(arguments.out, view);
  const KeyFrames frames = arguments.motion.Read();
  const Model model = Model::Load(arguments.model);
  const Motion motion(model.Resolver(), frames, DeformationModeFromName(arguments.mode));
  WarnOfMotion(model, frames);
  Backend backend(context.backend);
  const auto engine = model.MakeEngine(backend);
  ProgressBar bar(context.quiet);
  const Progress progress = bar.AsProgress();
  const auto grid = [&] { return AnimationGrid(*engine, motion, frames, progress.Part(0, 0.3)); };
  const ScalarType type = model.template_scan().stored_as;
  if (target.pictures) {
    const auto sink = target.video ? VideoFile(arguments.out, frames.fps) : PictureFolder(arguments.out);
    WritePictures(*engine, motion, frames, {grid(), WindowOf(model.template_scan().volume)}, view.OfVideo(),
                  *sink, progress.Part(0.3, 1));
  } else {
    const auto sink = target.one_file ? NiftiSequence(arguments.out, type, frames.FrameCount(), frames.fps)
                                      : VolumeFolder(arguments.out, ".nii.gz", type);
    AnimateVolumes(*engine, motion, frames, grid(), view.level, *sink, progress.Part(0.3, 1));
  }
  bar.Finish();
  if (context.json)
    PrintDocument(nlohmann::ordered_json{{"frames", frames.FrameCount()}, {"fps", frames.fps}}.dump(1));
}

}  // namespace

void AddAnimate(CLI::App& program, CommandContext& context) {
  CLI::App* command =
      program.add_subcommand("animate", "Write a posed volume or picture per frame of a motion");
  auto arguments = std::make_shared<AnimateArguments>();
  AddModelFolder(*command, arguments->model);
  AddMotionOptions(*command, arguments->motion, "--keyframes");
  AddMode(*command, arguments->mode);
  AddSliceOptions(*command, arguments->view);
  AddOut(*command, arguments->out,
         "A folder (frame_0000.nii.gz, ...; with --axis or --projection frame_0000.png, ...), one 4-D .nii "
         "or .nii.gz, or a video (.mp4, .mkv, .webm, .gif; needs ffmpeg)",
         "DIR|FILE");
  AddComputing(*command, context);
  command->footer(
      "Examples:\n  kinevox animate knee.model --keyframes bend.json --level 1 --out bend.nii.gz\n"
      "  kinevox animate hand.model --keyframes capture.bvh --map joints.json --axis coronal \\\n"
      "      --projection max --out fist.mp4");
  command->callback([arguments, &context] { Run(*arguments, context); });
}

}  // namespace kvx
