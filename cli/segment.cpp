// kinevox segment: strokes or a threshold become a label map of bones, to look at before a model is built of
// it.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <iterator>
#include <nlohmann/json.hpp>

#include "api/views.h"
#include "cli/commands.h"
#include "cli/options/named_files.h"
#include "cli/terminal/interrupt.h"
#include "cli/terminal/progress_bar.h"
#include "core/region_presets.h"
#include "core/text/extension.h"
#include "core/text/parse_number.h"
#include "pipeline/io/volume_file.h"
#include "pipeline/model/files/study_file.h"
#include "pipeline/model/warnings/study_warnings.h"
#include "pipeline/scans/load_scan.h"
#include "pipeline/segmentation/names/propose_names.h"
#include "pipeline/segmentation/segment_bones.h"

namespace kvx {
namespace {

struct SegmentArguments {
  std::filesystem::path scan, seeds, previous, out;
  std::string threshold, region;  // region empty: the study's, or custom
};

struct Task {
  std::filesystem::path scan, seeds;
  std::string scan_name;  // as the user knows it
  SegmentBones::Options options;
  Region region = Region::kCustom;
  std::vector<StudyBone> list;
  std::vector<std::string> unread_fields;    // of the study
  std::vector<std::filesystem::path> scans;  // of the study, all of them
};

Task TaskOfStudy(const SegmentArguments& arguments) {
  const Study study = FromFile(arguments.scan, ReadStudy);
  if (study.bone_seeds.empty() && !study.bones_by_threshold) {
    throw InputError("the study has a finished label map in bones.labels; there is nothing to segment");
  }
  Task task{{},
            study.bone_seeds,
            "scan '" + study.template_scan + "'",
            {study.bone_level_hu, {}},
            study.region,
            study.bones,
            study.unread_fields,
            {}};
  for (const StudyBone& bone : study.bones) task.options.listed.push_back(bone.label);
  for (const StudyScan& scan : study.scans) {
    task.scans.push_back(scan.volume);
    if (scan.name == study.template_scan) task.scan = scan.volume;
  }
  return task;
}

Task TaskOf(const SegmentArguments& arguments) {
  const bool study = HasExtension(arguments.scan, ".json");
  const int given = !arguments.seeds.empty() + !arguments.threshold.empty();
  if (study && given > 0)
    throw UsageError("a study names its own seeds or threshold; leave --seeds and --threshold out");
  if (study && !arguments.region.empty())
    throw UsageError("a study names its own region; leave --region out");
  if (study) return TaskOfStudy(arguments);
  if (given != 1) throw UsageError("give one of --seeds and --threshold");
  RequireThere(arguments.scan);
  if (!arguments.seeds.empty()) RequireThere(arguments.seeds);
  const std::string region = arguments.region.empty() ? "custom" : arguments.region;
  Task task{arguments.scan, arguments.seeds, arguments.scan.string(), {}, RegionFromName(region), {}, {}, {}};
  if (arguments.seeds.empty() && arguments.threshold != "auto") {
    task.options.level_hu = ParseFinite(arguments.threshold);
    if (!task.options.level_hu) throw UsageError("--threshold is a level in HU, or auto");
  }
  return task;
}

// The study's own names where it gives them.
std::vector<ProposedBone> NamedBones(const SegmentedBones& bones, const Task& task) {
  std::vector<ProposedBone> named = NamesOf(bones, task.region);
  for (const StudyBone& listed : task.list) {
    const auto found = std::ranges::find(named, listed.label, &ProposedBone::label);
    if (found == named.end()) continue;
    found->name = listed.name, found->parent = listed.parent, found->confidence = 1,
    found->looks_like.clear();
  }
  return named;
}

void PrintLine(const ProposedBone& bone) {
  const std::string name = bone.name.empty()             ? "-"
                           : bone.confidence < kSureName ? bone.name + "?"
                                                         : bone.name;
  const Eigen::Vector3d& centre = bone.centre.lps;
  std::printf("label %3d  %-11s %8zu voxels  %8.2f cm3  centre %.1f %.1f %.1f (LPS mm)", bone.label,
              name.c_str(), bone.voxels, bone.cm3, centre.x(), centre.y(), centre.z());
  if (bone.expected_dice) std::printf("  expected Dice %.2f", *bone.expected_dice);
  std::printf("\n");
}

void Print(const std::vector<ProposedBone>& bones, const std::vector<std::string>& warnings, bool json) {
  nlohmann::ordered_json list = nlohmann::ordered_json::array();
  for (const ProposedBone& bone : bones) {
    if (!json) PrintLine(bone);
    list.push_back(View(bone));
  }
  if (json) PrintDocument(nlohmann::ordered_json{{"bones", list}, {"warnings", warnings}}.dump(2));
}

void RequireReadable(const Task& task, const std::filesystem::path& previous) {
  RequireReadableDicom(task.scan, task.scan_name);
  RequireReadableSegments(task.seeds, "the strokes");
  RequireReadableSegments(previous, "--previous");
}

Scan ReadNamed(const Task& task) {
  try {
    return ReadScanEvenly(task.scan);
  } catch (const InputError& error) {
    throw InputError(task.scan_name + ": " + error.what());
  }
}

void Run(const SegmentArguments& arguments, const CommandContext& context) {
  CatchInterrupts();
  const Task task = TaskOf(arguments);
  RequireWritableExtension(arguments.out);
  RequireMayWrite(arguments.out);
  RequireOther(arguments.out, task.scan, "the scan");
  for (const std::filesystem::path& scan : task.scans)
    RequireOther(arguments.out, scan, "a scan of the study");
  if (!task.seeds.empty()) RequireOther(arguments.out, task.seeds, "the strokes");
  if (!arguments.previous.empty() && task.seeds.empty())
    throw UsageError("--previous goes with strokes; a threshold starts from nothing");
  if (!arguments.previous.empty()) RequireThere(arguments.previous);
  RequireReadable(task, arguments.previous);
  const Artifact<Scan> scan{{}, std::make_shared<Scan>(ReadNamed(task))};
  Backend backend(context.backend);
  ProgressBar bar(context.quiet);
  StageContext stage{backend, bar.AsProgress()};
  const SegmentedBones bones =
      SegmentBones::Run({scan, {}, task.seeds, {}, arguments.previous}, task.options, stage);
  bar.Finish();
  WriteLabels(arguments.out, bones.labels);
  const std::vector<ProposedBone> named = NamedBones(bones, task);
  std::vector<std::string> warnings = UnreadFieldWarnings(task.unread_fields);
  std::ranges::move(ScanWarnings(task.scan_name, *scan), std::back_inserter(warnings));
  std::ranges::move(WarningsOf(bones, named), std::back_inserter(warnings));
  if (task.region != Region::kCustom) {
    for (const std::string& doubt : NamesInDoubt(named)) warnings.push_back(doubt);
  }
  for (const std::string& warning : warnings) Warn(warning);
  Print(named, warnings, context.json);
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
  command
      ->add_option("--previous", arguments->previous,
                   "The label map that fewer of these strokes gave: only bones that new strokes change are "
                   "looked for again")
      ->type_name("FILE");
  command
      ->add_option("--threshold", arguments->threshold,
                   "CT without strokes: a level in HU (60 or more), or auto")
      ->type_name("HU");
  command
      ->add_option("--region", arguments->region,
                   "hand or knee: propose names for the labels; custom (default): none")
      ->check(CLI::IsMember({"hand", "knee", "custom"}));
  AddOut(*command, arguments->out, "The label map: .nii.gz, .nrrd or .mha");
  AddComputing(*command, context);
  command->footer(
      "About a dozen short strokes a bone are enough, through marrow and up to the cortex, and some in the "
      "tissue around.\n"
      "By a threshold the labels are numbered by size. Names are proposed by the region, unsure ones with "
      "'?'; the study's bones.list corrects them.\n"
      "With --previous a bone keeps its voxels unless a stroke says otherwise; give all strokes of the bones "
      "that change, old ones too: one without any only loses the voxels that strokes mark as something else, "
      "with a warning. Background alone is enough then. A stroke taken away is not noticed.\n"
      "A bone goes no farther than a growth plate or a fracture that crosses it: draw strokes on either "
      "side.\n"
      "No voxel of a stroke is ever given to anything else.\n\n"
      "Examples:\n  kinevox segment pose00.nii.gz --seeds strokes.nii.gz --out bones.nii.gz\n"
      "  kinevox segment pose00.nii.gz --seeds more.nii.gz --previous bones.nii.gz --out bones.nii.gz\n"
      "  kinevox segment wrist.nii.gz --threshold auto --out bones.nii.gz");
  command->callback([arguments, &context] { Run(*arguments, context); });
}

}  // namespace kvx
