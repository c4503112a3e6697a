// kinevox field: maps back to the template, of a pose (coarse) or of a scan, the way there, and how sure a
// scan's registration is.
#include <CLI/CLI.hpp>
#include <chrono>
#include <cstdio>
#include <mutex>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/options/named_files.h"
#include "cli/options/pose_options.h"
#include "cli/terminal/interrupt.h"
#include "cli/terminal/kept_memory.h"
#include "cli/terminal/progress_bar.h"
#include "core/text/extension.h"
#include "pipeline/io/volume_file.h"
#include "pipeline/model/map_from_scan.h"
#include "pipeline/posing/inverse_grid.h"

namespace kvx {
namespace {

struct FieldArguments {
  std::filesystem::path model, out;
  PoseOptions pose;
  int level = 2;
  bool forward = false, inverse = false, confidence = false, error = false;
  int OfScan() const { return forward + inverse + confidence + error; }
};

// Work that is asked whether it goes on, and does not say how far it is: on a terminal the time that it has
// taken stands for that.
class TakenTime {
 public:
  explicit TakenTime(bool quiet) : form_(ProgressBar::FormFor(stderr, quiet)), bar_(quiet) {}
  Progress AsProgress() {
    return {{}, [this] { return Show(), InterruptRequested(); }};
  }

 private:
  using Clock = std::chrono::steady_clock;
  void Show() {
    if (form_ != ProgressBar::Form::kBar) return;
    const std::lock_guard lock(mutex_);
    const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(Clock::now() - began_).count();
    if (seconds > 0) bar_.Show("field, " + std::to_string(seconds) + " s so far", 0);
  }

  const ProgressBar::Form form_;
  const Clock::time_point began_ = Clock::now();
  std::mutex mutex_;
  ProgressBar bar_;
};

void WriteOfScan(const Model& model, const FieldArguments& arguments, bool quiet) {
  const std::string& scan = arguments.pose.scan;
  TakenTime taken(quiet);
  if (arguments.forward) return WriteField(arguments.out, ScanFromTemplate(model, scan));
  if (arguments.inverse) return WriteField(arguments.out, TemplateFromScan(model, scan, taken.AsProgress()));
  if (arguments.error) return WriteVolume(arguments.out, PlaceErrorOf(model, scan), ScalarType::kFloat32);
  WriteVolume(arguments.out, ConfidenceOf(model, scan), ScalarType::kUint8);
}

// niftilib, which ITK and what is built on it read with, makes such values 0.
void WarnOfNifti(const FieldArguments& arguments) {
  const bool nifti = HasExtension(arguments.out, ".nii") || HasExtension(arguments.out, ".nii.gz");
  if (!nifti || !(arguments.error || arguments.inverse)) return;
  Warn(
      "places that are not known are not a number; programs on ITK (SimpleITK, say) read those of a "
      "NIfTI file as 0 mm: use .nrrd or .mha for them");
}

void RunOfScan(const FieldArguments& arguments, const CommandContext& context) {
  if (arguments.pose.scan.empty() || arguments.OfScan() > 1)
    throw UsageError("--forward, --inverse, --confidence and --error go with --scan, one at a time");
  const Model model = arguments.pose.Load(arguments.model);
  WarnOfScan(model, arguments.pose.scan);
  WarnOfNifti(arguments);
  ThrowIfInterrupted();
  WriteOfScan(model, arguments, context.quiet);
  if (!context.json) return;
  const char* holds = arguments.forward   ? "template to scan, mm"
                      : arguments.inverse ? "scan to template, mm"
                      : arguments.error   ? "error of places, mm"
                                          : "confidence, per cent";
  PrintDocument(nlohmann::ordered_json{{"scan", arguments.pose.scan}, {"holds", holds}}.dump(1));
}

InverseGrid FieldOf(const PosingEngine& engine, const Mask& body, const ResolvedPose& pose, int level,
                    bool quiet) {
  TakenTime taken(quiet);
  return CoarseInverse(engine, body, pose, level, taken.AsProgress());
}

void Run(const FieldArguments& arguments, const CommandContext& context) {
  KeepFreedMemory(kBlocksOfAProduct);
  CatchInterrupts();
  RequireWritableExtension(arguments.out);
  RequireMayWrite(arguments.out);
  if (arguments.OfScan() > 0) return RunOfScan(arguments, context);
  const auto [model, pose] = LoadPosed(arguments.pose, arguments.model);
  Backend backend(context.backend);
  const InverseGrid field =
      FieldOf(*model.MakeEngine(backend), model.body(), pose, arguments.level, context.quiet);
  WriteField(arguments.out, field.template_from_posed);
  if (context.json) {
    return PrintDocument(nlohmann::ordered_json{{"largest_error_mm", field.largest_error_mm},
                                                {"p99_error_mm", field.p99_error_mm},
                                                {"mean_error_mm", field.mean_error_mm}}
                             .dump(1));
  }
  std::printf("error over tissue: mean %.3f mm, 99 %% below %.3f mm, largest %.3f mm\n", field.mean_error_mm,
              field.p99_error_mm, field.largest_error_mm);
}

// A scan's maps are as the registration left them.
void RequireOfPose(const CLI::App& command, const FieldArguments& arguments) {
  if (arguments.OfScan() == 0) return;
  for (const char* name : {"--level", "--mode", "--space", "--basis"}) {
    if (command.count(name) > 0)
      throw CLI::ValidationError(name, "is of a pose's field; leave it out of what is known of a scan");
  }
}

// Instead of a pose's field: what is known of one scan.
void AddMapsOfScan(CLI::App& command, FieldArguments& arguments) {
  command.add_flag(
      "--forward", arguments.forward,
      "With --scan: the registered map from the template to the scan, on the template's grid: scan "
      "= x + u(x); says something in the body only");
  command.add_flag(
      "--inverse", arguments.inverse,
      "With --scan: the registered map from the scan back to the template, on the scan's grid; not a number "
      "where no tissue of the template comes to; see --error");
  command.add_flag(
      "--confidence", arguments.confidence,
      "With --scan: how likely it is, in per cent, that a voxel's place is right to half a voxel, on the "
      "template's grid; 0 outside the body, where the scan does not show it and where its bone is in doubt");
  command.add_flag(
      "--error", arguments.error,
      "With --scan: how far off, in mm, the registration may be, on the template's grid: two of three voxels "
      "are not farther off, nineteen of twenty not farther than twice that; not a number where it is not "
      "known. Programs on ITK (SimpleITK, say) read that of a NIfTI file as 0 mm: choose .nrrd or "
      ".mha");
}

}  // namespace

void AddField(CLI::App& program, CommandContext& context) {
  CLI::App* command =
      program.add_subcommand("field", "Write the coarse displacement from a pose back to the template");
  auto arguments = std::make_shared<FieldArguments>();
  AddPosedModel(*command, arguments->model, arguments->pose);
  command
      ->add_option("--level", arguments->level,
                   "Resolution of the grid: 0 the template's, 1 half, 2 a quarter, ...")
      ->check(CLI::Range(0, 5))
      ->capture_default_str()
      ->type_name("L");
  AddMapsOfScan(*command, *arguments);
  AddOut(
      *command, arguments->out,
      "Vectors of three floats, LPS mm (.nrrd, .mha, .nii.gz): template = x + u(x), unless said otherwise");
  AddComputing(*command, context);
  command->footer(
      "Examples:\n  kinevox field knee.model --joint tibia.flexion=35 --level 2 --out back.nrrd\n"
      "  kinevox field knee.model --scan pose02 --inverse --out template_from_pose02.nrrd\n"
      "  kinevox field knee.model --scan pose02 --confidence --out sure.nii.gz");
  command->callback([arguments, command, &context] {
    RequireOfPose(*command, *arguments);
    Run(*arguments, context);
  });
}

}  // namespace kvx
