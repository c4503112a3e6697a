// kinevox surface: posed bones and skin as triangles.
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/options/named_files.h"
#include "cli/options/pose_options.h"
#include "cli/terminal/kept_memory.h"
#include "core/text/comma_list.h"
#include "core/text/extension.h"
#include "pipeline/io/surface_file.h"
#include "pipeline/posing/posed_surfaces.h"

namespace kvx {
namespace {

struct SurfaceArguments {
  std::filesystem::path model, out;
  PoseOptions pose;
  std::vector<std::string> bones;  // as given: names, or lists of them
  SurfaceChoice choice;
  SurfaceOptions options;
};

void Print(const std::vector<NamedSurface>& surfaces) {
  nlohmann::ordered_json document = nlohmann::ordered_json::array();
  for (const NamedSurface& surface : surfaces) {
    document.push_back({{"name", surface.name},
                        {"vertices", surface.mesh.vertices_mm.size()},
                        {"triangles", surface.mesh.triangles.size()},
                        {"closed", IsClosed(surface.mesh)},
                        {"area_mm2", AreaMm2(surface.mesh)},
                        {"volume_mm3", EnclosedVolumeMm3(surface.mesh)}});
  }
  PrintDocument(nlohmann::ordered_json{{"surfaces", document}}.dump(1));
}

SurfaceChoice ChoiceOf(const SurfaceArguments& arguments) {
  SurfaceChoice choice = arguments.choice;
  for (const std::string& names : arguments.bones) AddNamesOf(names, choice.bones);
  if (!arguments.bones.empty() && choice.bones.empty())
    throw UsageError("--bone holds no name; give names of bones with commas between them, or leave it out");
  return choice;
}

void Run(const SurfaceArguments& arguments, const CommandContext& context) {
  KeepFreedMemory(kBlocksOfAProduct);
  const SurfaceChoice choice = ChoiceOf(arguments);
  if (!HasExtension(arguments.out, ".glb") && !HasExtension(arguments.out, ".stl"))
    throw InputError("--out must end in .glb or .stl: the extension chooses the format");
  RequireMayWrite(arguments.out);
  const auto [model, pose] = LoadPosed(arguments.pose, arguments.model);
  Backend backend(context.backend);
  const auto engine = model.MakeEngine(backend);
  const TemplateSurfaces surfaces(model.bones(), model.body(), arguments.options);
  const std::vector<NamedSurface> posed = surfaces.Posed(*engine, pose, choice);
  WriteSurfaces(arguments.out, posed);
  if (context.json) Print(posed);
}

}  // namespace

void AddSurface(CLI::App& program, CommandContext& context) {
  CLI::App* command = program.add_subcommand("surface", "Write posed surfaces of bones and skin");
  auto arguments = std::make_shared<SurfaceArguments>();
  AddPosedModel(*command, arguments->model, arguments->pose);
  command
      ->add_option("--bone", arguments->bones,
                   "Names of bones with commas between them, may be repeated (default: all bones and the "
                   "skin)")
      ->take_all()
      ->allow_extra_args(false)
      ->type_name("NAME[,NAME]");
  command->add_flag("--skin", arguments->choice.skin, "The skin; with --bone: beside those bones");
  command
      ->add_option("--smoothing", arguments->options.smoothing_vox,
                   "Gaussian on the distance to the surface, voxels")
      ->check(CLI::Range(0.0, 5.0))
      ->capture_default_str();
  command
      ->add_option(
          "--largest-error", arguments->options.largest_error_vox,
          "About how far the simplified surface may be from the full one, voxels (single places twice "
          "that); 0 keeps every triangle")
      ->check(CLI::Range(0.0, 5.0))
      ->capture_default_str();
  AddOut(*command, arguments->out, ".glb: one node per bone, metres, y up; .stl: LPS mm");
  AddComputing(*command, context);
  command->footer(
      "Examples:\n  kinevox surface knee.model --joint tibia.flexion=35 --out bent.glb\n"
      "  kinevox surface hand.model --scan pose02 --skin --out skin.stl");
  command->callback([arguments, &context] { Run(*arguments, context); });
}

}  // namespace kvx
