// kinevox info: everything known about a model.
#include "pipeline/model/info.h"

#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>

#include "cli/commands.h"
#include "core/joint_values.h"
#include "pipeline/model/scan_verdict.h"
#include "pipeline/model/warnings/bone_warnings.h"
#include "pipeline/skeleton/bone_certainty.h"

namespace kvx {
namespace {

void PrintBones(const Model& model) {
  std::printf("\nbones\n");
  for (const Bone& bone : model.bones().bones) {
    const char* parent =
        bone.parent == kNoParent ? "(root)" : model.bone_names()[size_t(bone.parent)].c_str();
    std::printf("  %3d %-16s %-16s %8zu voxels, %.0f x %.0f x %.0f mm\n", bone.label, bone.name.c_str(),
                parent, bone.voxels, bone.box.extent_mm.x(), bone.box.extent_mm.y(), bone.box.extent_mm.z());
  }
}

std::string TiltText(const Joint& joint, double within_rad) {
  if (!std::isfinite(within_rad))
    return joint.dofs.size() < 3 ? "the scans do not tell its axis"
                                 : "no bound: three axes explain every turn";
  char text[64];
  std::snprintf(text, sizeof text, "axis within %.1f degrees", DegFromRad(within_rad));
  return text;
}

void PrintJoints(const Model& model) {
  std::printf("\njoints (limits, and in brackets what the scans show)\n");
  for (const Joint& joint : model.fit().skeleton.joints) {
    for (size_t d = 0; d < joint.dofs.size(); ++d) {
      const DegreeOfFreedom& dof = joint.dofs[d];
      const std::string name = model.bone_names()[size_t(joint.child)] + "." + dof.name;
      const ScannedRange scanned = ScannedRangeOf(dof, IsShift(d));
      std::printf("  %-28s %7.1f .. %6.1f (%.1f .. %.1f) %s, centre residual %.2f mm, %s\n", name.c_str(),
                  DegFromRad(dof.min_rad), DegFromRad(dof.max_rad), DegFromRad(scanned.min_rad),
                  DegFromRad(scanned.max_rad), IsShift(d) ? "mm" : "degrees", joint.residual_mm,
                  TiltText(joint, model.fit().AxisWithinRad(joint.child, d)).c_str());
    }
  }
}

void PrintCertainty(const Model& model, const BoneFits& fits) {
  const ScanVerdict verdict = VerdictOf(model.bones(), fits);
  if (!verdict.note.empty()) std::printf("%-12s %s\n", "", verdict.note.c_str());
  const double voxel_mm = model.bones().labels.grid.MeanSpacingMm();
  for (size_t j = 0; j < fits.size(); ++j) {
    const Certainty certainty = CertaintyOf(model.bones().bones[j], fits[j], voxel_mm);
    if (certainty == Certainty::kUncertain || fits[j].doubt == Doubt::kBone)
      std::printf("%-12s %s: %s (%s)\n", "", std::string(NameOf(certainty)).c_str(),
                  model.bone_names()[j].c_str(), fits[j].note.c_str());
  }
  const std::string coarse = CoarseBonesText(model.bones(), fits);
  if (!coarse.empty()) std::printf("%-12s %s\n", "", coarse.c_str());
}

// Models made before version 0.90 know the sum alone.
void PrintControlPoints(const ModelScan& scan) {
  std::string levels;
  for (const int64_t points : scan.control_points_per_level)
    levels += (levels.empty() ? ", from coarse to fine " : " + ") + std::to_string(points);
  std::printf("%-12s control points: %lld%s\n", "", static_cast<long long>(scan.control_points),
              levels.c_str());
}

void PrintScans(const Model& model) {
  std::printf("\n%-12s %-11s %7s %6s %6s   (root mean square difference, correlation, mutual information)\n",
              "scan", "stage", "SSD", "CC", "MI");
  for (size_t k = 0; k < model.scan_names().size(); ++k) {
    const ModelScan& scan = model.manifest().scans[k];
    for (const char* stage : {"source", "initialise", "register"}) {
      const auto found = scan.measures.find(stage);
      if (found == scan.measures.end()) continue;
      const Measures& m = found->second;
      std::printf("%-12s %-11s %7.1f %6.2f %6.2f\n", scan.name.c_str(), stage, m.ssd, m.cc, m.mi);
    }
    std::printf("%-12s registration: ", "");
    if (const auto confidence = model.manifest().ConfidenceOf(scan))
      std::printf("confidence %.0f %%, unsure in %.0f %% of the body, ", confidence->mean_percent,
                  100 * confidence->unsure_fraction);
    std::printf("folded in %.4f %%\n", 100 * scan.folded_fraction);
    PrintControlPoints(scan);
    PrintCertainty(model, model.scan_fits()[k]);
  }
  const std::string advice = UncertainBonesAdvice(model.bones(), model.scan_fits());
  if (!advice.empty()) std::printf("\n%s\n", advice.c_str());
}

// All but those that PrintScans says at greater length.
void PrintWarnings(const Model& model) {
  std::vector<std::string> warnings = model.manifest().warnings;
  for (size_t k = 0; k < model.scan_names().size(); ++k) {
    for (const std::string& said : BoneWarnings(model.scan_names()[k], model.bones(), model.scan_fits()[k]))
      std::erase(warnings, said);
  }
  if (!warnings.empty()) std::printf("\n");
  for (const std::string& warning : warnings) std::printf("warning: %s\n", warning.c_str());
}

void PrintInfo(const Model& model) {
  const ModelManifest& manifest = model.manifest();
  const Grid& grid = model.template_scan().volume.grid;
  std::printf("model    %s (%s), %s method, made by kinevox %s on %s\n", manifest.name.c_str(),
              manifest.region.c_str(), manifest.method.c_str(), manifest.program_version.c_str(),
              manifest.device.c_str());
  std::printf("template %s, %d x %d x %d voxels of %.3g x %.3g x %.3g mm\n", manifest.template_scan.c_str(),
              grid.size.x(), grid.size.y(), grid.size.z(), grid.spacing_mm.x(), grid.spacing_mm.y(),
              grid.spacing_mm.z());
  std::printf("digest   %s\n", manifest.ContentDigest().Hex().c_str());
  PrintBones(model);
  PrintJoints(model);
  PrintScans(model);
  PrintWarnings(model);
  std::printf("\nseconds ");
  for (const auto& [stage, seconds] : manifest.seconds) std::printf(" %s %.1f", stage.c_str(), seconds);
  std::printf("\n");
}

}  // namespace

void AddInfo(CLI::App& program, CommandContext& context) {
  CLI::App* command = program.add_subcommand("info", "Everything known about a model");
  auto model = std::make_shared<std::filesystem::path>();
  AddModelFolder(*command, *model);
  AddQuiet(*command, context);
  AddJson(*command, context);
  command->footer(
      "Limits of joints are 5 degrees (of shifts 2 mm) wider at both ends than what the scans show. They are "
      "advice: a pose beyond them is warned of, not refused.\n\n"
      "Example:\n  kinevox info knee.model --json");
  command->callback([model, &context] {
    const Model loaded = Model::Load(*model);
    if (context.json)
      PrintDocument(InfoJson(loaded));
    else
      PrintInfo(loaded);
  });
}

}  // namespace kvx
