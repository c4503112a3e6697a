// kinevox map-points: where template points go.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/options/named_files.h"
#include "cli/options/pose_options.h"
#include "core/text/points_csv.h"
#include "pipeline/io/atomic_file.h"
#include "pipeline/model/map_from_scan.h"
#include "pipeline/model/map_to_scan.h"

namespace kvx {
namespace {

struct MapArguments {
  std::filesystem::path model, points, out;
  PoseOptions pose;
  std::string stage;
  bool mode_given = false, space_given = false, inverse = false;
};

int64_t LostOf(const std::vector<PointMm>& points) {
  return std::count_if(points.begin(), points.end(), [](const PointMm& p) { return !p.lps.allFinite(); });
}

std::vector<PointMm> Mapped(const MapArguments& arguments, const Model& model, Backend& backend,
                            const std::vector<PointMm>& in_template) {
  if (!arguments.pose.scan.empty() && !arguments.mode_given) {
    WarnOfScan(model, arguments.pose.scan);
    const ScanStage stage = arguments.stage == "initialise" ? ScanStage::kInitialise : ScanStage::kRegister;
    return MapPointsToScan(model, arguments.pose.scan, stage, in_template);
  }
  const PoseRequest request = arguments.pose.Request();
  const ResolvedPose pose = model.Resolve(request, arguments.pose.Mode());
  WarnOfPose(model, request, pose);
  return model.MakeEngine(backend)->MapPoints(pose, in_template);
}

// Rows that no tissue of the template comes to keep their place, as "nan".
std::vector<PointMm> MappedBack(const MapArguments& arguments, const Model& model,
                                const std::vector<PointMm>& in_scan) {
  WarnOfScan(model, arguments.pose.scan);
  std::vector<PointMm> out = MapPointsFromScan(model, arguments.pose.scan, in_scan);
  const auto lost = LostOf(out);
  if (lost > 0) Warn(std::to_string(lost) + " points show nothing of the template; their rows hold nan");
  return out;
}

void Run(const MapArguments& arguments, const CommandContext& context) {
  if (arguments.inverse && (arguments.pose.scan.empty() || arguments.mode_given || !arguments.stage.empty()))
    throw UsageError("--inverse goes with --scan, and not with --mode or --stage");
  if (!arguments.stage.empty() && (arguments.pose.scan.empty() || arguments.mode_given)) {
    throw UsageError("--stage goes with --scan, and not with --mode");
  }
  if (arguments.space_given && !arguments.pose.scan.empty() && !arguments.mode_given) {
    throw UsageError(
        "a scan's points go where it was registered, whatever the pose space; leave --space and --basis out, "
        "or add --mode to have them posed");
  }
  RequireMayWrite(arguments.out);
  PointTable table = FromFile(
      arguments.points, [](const std::filesystem::path& named) { return ParsePoints(ContentOf(named)); });
  const Model model = arguments.pose.Load(arguments.model);
  Backend backend(context.backend);
  ReplacePoints(table.points, [&](const auto& points) {
    return arguments.inverse ? MappedBack(arguments, model, points)
                             : Mapped(arguments, model, backend, points);
  });
  WriteFileAtomically(arguments.out, FormatPoints(table));
  if (context.json)
    PrintDocument(
        nlohmann::ordered_json{{"points", table.points.size()}, {"lost", LostOf(table.points)}}.dump(1));
}

}  // namespace

void AddMapPoints(CLI::App& program, CommandContext& context) {
  CLI::App* command =
      program.add_subcommand("map-points", "Carry points of the template into a pose or a scan");
  auto arguments = std::make_shared<MapArguments>();
  AddPosedModel(*command, arguments->model, arguments->pose);
  command
      ->add_option(
          "--stage", arguments->stage,
          "With --scan: initialise (bones alone, eq. 2) or register (the registered correspondence, default)")
      ->check(CLI::IsMember({"initialise", "register"}));
  command->add_flag("--inverse", arguments->inverse,
                    "With --scan: carry points of the scan back into the template; nan where the template "
                    "has no such tissue");
  command
      ->add_option(
          "--points", arguments->points,
          "CSV with the header x,y,z, LPS mm; further columns are kept. Semicolons or tabs, with decimal "
          "commas or points, are read too")
      ->required()
      ->type_name("IN.csv");
  AddOut(*command, arguments->out, "The same rows with mapped x,y,z: commas and decimal points", "OUT.csv");
  AddComputing(*command, context);
  command->footer(
      "Examples:\n  kinevox map-points knee.model --scan pose02 --points landmarks.csv --out in_pose02.csv\n"
      "  kinevox map-points knee.model --joint tibia.flexion=35 --points landmarks.csv --out bent.csv");
  command->callback([arguments, command, &context] {
    arguments->mode_given = command->count("--mode") > 0;
    arguments->space_given = command->count("--space") + command->count("--basis") > 0;
    Run(*arguments, context);
  });
}

}  // namespace kvx
