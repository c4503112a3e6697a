// kinevox pose: one posed volume, or its bone labels.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/options/named_files.h"
#include "cli/options/pose_options.h"
#include "cli/terminal/interrupt.h"
#include "cli/terminal/kept_memory.h"
#include "core/text/extension.h"
#include "pipeline/io/volume_file.h"
#include "pipeline/model/posed_series.h"

namespace kvx {
namespace {

struct PoseArguments {
  std::filesystem::path model, out, extrapolation_map;
  PoseOptions pose;
  int level = 0;
  bool label = false;
  std::string modality;
};

bool IsDicom(const PoseArguments& arguments) {
  return HasExtension(arguments.out, arguments.label ? ".dcm" : ".zip");
}

std::string Document(const Grid& grid, const ResolvedPose& pose, double folded_fraction, const Model& model) {
  const auto numbers = [](const Eigen::Vector3d& v) { return nlohmann::json{v.x(), v.y(), v.z()}; };
  nlohmann::ordered_json document{{"size", {grid.size.x(), grid.size.y(), grid.size.z()}},
                                  {"spacing", numbers(grid.spacing_mm)},
                                  {"origin", numbers(grid.origin.lps)},
                                  {"folded_fraction", folded_fraction},
                                  {"scan_from_template", nlohmann::ordered_json::object()},
                                  {"extrapolation", nlohmann::ordered_json::object()}};
  for (size_t j = 0; j < model.bone_names().size(); ++j) {
    document["scan_from_template"][model.bone_names()[j]] = RowMajor(pose.scan_from_template[j]);
    if (pose.extrapolation.size())
      document["extrapolation"][model.bone_names()[j]] = pose.extrapolation[Eigen::Index(j)];
  }
  return document.dump(1);
}

// Sum over bones of weight times the bone's extrapolation, in the body of the template.
Volume ExtrapolationMap(const Model& model, const ResolvedPose& pose) {
  Volume map(model.body().grid);
  for (size_t v = 0; v < map.values.size(); ++v) {
    if (!model.body().values[v]) continue;
    const VoxelWeights& at = model.weights().values[v];
    for (int s = 0; s < kBonesPerVoxel; ++s)
      map.values[v] += at.weights[s] * float(pose.extrapolation[at.bones[s]]);
  }
  return map;
}

void RequireMapOut(const PoseArguments& arguments) {
  WithName<InputError>("--extrapolation-map", [&] {
    RequireWritableExtension(arguments.extrapolation_map);
    RequireMayWrite(arguments.extrapolation_map);
  });
  RequireOther(arguments.out, arguments.extrapolation_map, "the extrapolation map");
}

void RequireFitting(const PoseArguments& arguments) {
  if (arguments.label)
    RequireVolumeOr(".dcm", "a DICOM segmentation (SEG); for a plain label map", arguments.out);
  else
    RequireVolumeOr(".zip", "a DICOM series; for one file", arguments.out);
  RequireMayWrite(arguments.out);
  if (!arguments.extrapolation_map.empty()) RequireMapOut(arguments);
  if (!IsDicom(arguments) && !arguments.modality.empty())
    throw UsageError("--modality is for DICOM: an --out that ends in .zip, or with --label in .dcm");
}

DicomSeries SeriesOf(const PoseArguments& arguments, const PoseRequest& request, const ResolvedPose& pose,
                     const Model& model) {
  const PosedAs as{request, arguments.pose.Mode(), arguments.level, LargestExtrapolation(pose)};
  const std::string patient_id = model.manifest().template_key.Hex().substr(0, 16);
  return kvx::SeriesOf(model, as, arguments.modality, patient_id);
}

// A segmentation names the images that it is of, which are made for that.
void WriteBones(const PoseArguments& arguments, const PoseRequest& request, const ResolvedPose& pose,
                const LabelMap& labels, const Model& model, const PosingEngine& engine) {
  if (!IsDicom(arguments)) return WriteLabels(arguments.out, labels);
  const Volume posed = engine.Pose(pose, {}, arguments.level).volume;
  ThrowIfInterrupted();
  WritePosedBones(arguments.out, model, labels, posed, SeriesOf(arguments, request, pose, model));
}

void Write(const PoseArguments& arguments, const PoseRequest& request, const ResolvedPose& pose,
           const Volume& posed, const Model& model) {
  const Scan& from = model.template_scan();
  if (!IsDicom(arguments)) return WriteVolume(arguments.out, posed, from.stored_as);
  WriteDicomZip(arguments.out, posed, DicomGreysOf(from), SeriesOf(arguments, request, pose, model));
}

void Run(const PoseArguments& arguments, const CommandContext& context) {
  KeepFreedMemory(kBlocksOfAProduct);
  CatchInterrupts();
  RequireFitting(arguments);
  const PoseRequest request = arguments.pose.Request();
  const auto [model, pose] = LoadPosed(arguments.pose, request, arguments.model);
  ThrowIfInterrupted();
  if (!arguments.extrapolation_map.empty())
    WriteVolume(arguments.extrapolation_map, ExtrapolationMap(model, pose), ScalarType::kFloat32);
  Backend backend(context.backend);
  const auto engine = model.MakeEngine(backend);
  Grid grid;
  double folded_fraction = 0;
  if (arguments.label) {
    const LabelMap labels = engine->PoseLabels(pose, {}, arguments.level);
    grid = labels.grid;
    ThrowIfInterrupted();
    WriteBones(arguments, request, pose, labels, model, *engine);
  } else {
    const PosedVolume posed = engine->Pose(pose, {}, arguments.level);
    grid = posed.volume.grid;
    folded_fraction = posed.folded_fraction;
    ThrowIfInterrupted();
    Write(arguments, request, pose, posed.volume, model);
  }
  if (context.json) PrintDocument(Document(grid, pose, folded_fraction, model));
}

}  // namespace

void AddPose(CLI::App& program, CommandContext& context) {
  CLI::App* command = program.add_subcommand("pose", "Write one posed volume");
  auto arguments = std::make_shared<PoseArguments>();
  AddPosedModel(*command, arguments->model, arguments->pose);
  AddLevel(*command, arguments->level);
  command
      ->add_option("--extrapolation-map", arguments->extrapolation_map,
                   "Write, on the template's grid, how far outside the examples each place is asked to go "
                   "(0: inside, 1: a typical distance of two examples beyond)")
      ->type_name("FILE");
  command->add_flag("--label", arguments->label, "Posed bone labels instead of intensities");
  AddModality(*command, arguments->modality);
  AddOut(*command, arguments->out,
         "Volume to write; format by extension (.nii, .nii.gz, .nrrd, .mha, .mhd with its voxels in "
         "NAME.raw; .zip: a DICOM series; with --label .dcm: a DICOM segmentation of that series)");
  AddComputing(*command, context);
  command->footer(
      "Examples:\n  kinevox pose knee.model --joint tibia.flexion=35 --out bent.nii.gz\n"
      "  kinevox pose hand.model --pose fist.json --level 1 --out fist.nrrd\n"
      "  kinevox pose knee.model --scan pose02 --label --out bones.nii.gz\n"
      "  kinevox pose knee.model --scan pose02 --label --out bones.dcm\n"
      "  kinevox pose knee.model --joint tibia.flexion=35 --modality MR --out series.zip");
  command->callback([arguments, &context] { Run(*arguments, context); });
}

}  // namespace kvx
