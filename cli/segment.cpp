// kinevox segment: strokes or a threshold become a label map of bones, to look at before a model is built of
// it.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/interrupt.h"
#include "cli/progress_bar.h"
#include "pipeline/io/volume_file.h"
#include "pipeline/model/study_file.h"
#include "pipeline/segmentation/segment_bones.h"

namespace kvx {
namespace {

struct SegmentArguments {
  std::filesystem::path scan, seeds, out;
  std::string threshold;
};

struct Task {
  std::filesystem::path scan, seeds;
  SegmentBones::Options options;
};

Task TaskOfStudy(const SegmentArguments& arguments) {
  const Study study = ReadStudy(arguments.scan);
  if (study.bone_seeds.empty() && !study.bones_by_threshold) {
    throw InputError("the study has a finished label map in bones.labels; there is nothing to segment");
  }
  Task task{{}, study.bone_seeds, {study.bone_level_hu}};
  for (const StudyScan& scan : study.scans) {
    if (scan.name == study.template_scan) task.scan = scan.volume;
  }
  return task;
}

Task TaskOf(const SegmentArguments& arguments) {
  const bool study = arguments.scan.extension() == ".json";
  const int given = !arguments.seeds.empty() + !arguments.threshold.empty();
  if (study && given > 0)
    throw UsageError("a study names its own seeds or threshold; leave --seeds and --threshold out");
  if (study) return TaskOfStudy(arguments);
  if (given != 1) throw UsageError("give --seeds or --threshold");
  Task task{arguments.scan, arguments.seeds, {}};
  if (arguments.seeds.empty() && arguments.threshold != "auto") {
    char* end = nullptr;
    task.options.level_hu = std::strtod(arguments.threshold.c_str(), &end);
    if (*end != '\0') throw UsageError("--threshold is a level in HU, or auto");
  }
  return task;
}

struct LabelFigures {
  size_t voxels = 0;
  Eigen::Vector3d centre_lps = Eigen::Vector3d::Zero();
};

std::map<int, LabelFigures> FiguresOf(const LabelMap& labels) {
  std::map<int, LabelFigures> figures;
  for (size_t v = 0; v < labels.values.size(); ++v) {
    if (labels.values[v] == 0) continue;
    LabelFigures& f = figures[labels.values[v]];
    f.voxels += 1;
    f.centre_lps += labels.grid.ToMm(PointVox{labels.grid.Ijk(v).cast<double>()}).lps;
  }
  for (auto& [label, f] : figures) f.centre_lps /= double(f.voxels);
  return figures;
}

void Print(const SegmentedBones& bones, bool json) {
  const double voxel_cm3 = bones.labels.grid.spacing_mm.prod() / 1000;
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const auto& [label, f] : FiguresOf(bones.labels)) {
    if (!json) {
      std::printf("label %3d  %8zu voxels  %8.2f cm3  centre %.1f %.1f %.1f (LPS mm)\n", label, f.voxels,
                  double(f.voxels) * voxel_cm3, f.centre_lps.x(), f.centre_lps.y(), f.centre_lps.z());
    }
    list.push_back({{"label", label},
                    {"voxels", f.voxels},
                    {"cm3", double(f.voxels) * voxel_cm3},
                    {"centre", {f.centre_lps.x(), f.centre_lps.y(), f.centre_lps.z()}}});
  }
  if (json) PrintDocument(nlohmann::ordered_json{{"bones", list}, {"warnings", bones.warnings}}.dump(2));
}

void Run(const SegmentArguments& arguments, const CommandContext& context) {
  CatchInterrupts();
  const Task task = TaskOf(arguments);
  Backend backend(context.backend);
  ProgressBar bar(context.quiet);
  StageContext stage{backend, bar.AsProgress()};
  const Artifact<Scan> scan{{}, std::make_shared<Scan>(ReadScan(task.scan))};
  const SegmentedBones bones = SegmentBones::Run({scan, {}, task.seeds}, task.options, stage);
  bar.Finish();
  WriteLabels(arguments.out, bones.labels);
  for (const std::string& warning : bones.warnings) Warn(warning);
  Print(bones, context.json);
}

}  // namespace

void AddSegment(CLI::App& program, CommandContext& context) {
  CLI::App* command = program.add_subcommand(
      "segment", "Make a label map of bones from strokes, or from a CT by a threshold");
  auto arguments = std::make_shared<SegmentArguments>();
  command
      ->add_option("scan", arguments->scan,
                   "The template's volume, or a study.json with bones.seeds or bones.threshold")
      ->required()
      ->type_name("VOLUME|STUDY");
  command->add_option("--seeds", arguments->seeds, "Strokes: a label map, bones 1, 2, ..., background 255")
      ->type_name("FILE");
  command->add_option("--threshold", arguments->threshold, "CT without strokes: a level in HU, or auto")
      ->type_name("HU");
  command->add_option("--out", arguments->out, "The label map: .nii.gz, .nrrd or .mha")
      ->required()
      ->type_name("FILE");
  AddDevice(*command, context);
  AddJson(*command, context);
  command->footer(
      "About a dozen short strokes a bone are enough, through marrow and up to the cortex, and some in the "
      "tissue around.\n"
      "By a threshold the labels are numbered by size; name them in the study's bones.list.\n\n"
      "Examples:\n  kinevox segment pose00.nii.gz --seeds strokes.nii.gz --out bones.nii.gz\n"
      "  kinevox segment wrist.nii.gz --threshold auto --out bones.nii.gz");
  command->callback([arguments, &context] { Run(*arguments, context); });
}

}  // namespace kvx
