// kinevox build: a study becomes a model.
#include <CLI/CLI.hpp>
#include <cstdio>

#include "cli/commands.h"
#include "cli/options/named_files.h"
#include "cli/options/paper_options.h"
#include "cli/terminal/interrupt.h"
#include "cli/terminal/kept_memory.h"
#include "cli/terminal/progress_bar.h"
#include "pipeline/model/build/build_model.h"
#include "pipeline/model/files/study_file.h"
#include "pipeline/model/info.h"

namespace kvx {
namespace {

struct BuildArguments {
  std::filesystem::path study, out, artifacts;
  std::string method = "adaptive";
  PaperOptions paper;
};

void PrintSummary(const ModelManifest& manifest, double wall_seconds) {
  std::printf("model '%s' of %zu scans on the template '%s', %s method\n", manifest.name.c_str(),
              manifest.scans.size() + 1, manifest.template_scan.c_str(), manifest.method.c_str());
  for (const ModelScan& scan : manifest.scans) {
    const Measures &before = scan.measures.at("source"), &after = scan.measures.at("register");
    std::printf("  %-12s SSD %5.1f -> %5.1f   CC %5.2f -> %5.2f   MI %5.2f -> %5.2f   folded %.4f %%\n",
                scan.name.c_str(), before.ssd, after.ssd, before.cc, after.cc, before.mi, after.mi,
                100 * scan.folded_fraction);
  }
  std::printf("digest %s\n%.1f s now; its stages took %.1f s, some of them side by side\n",
              manifest.ContentDigest().Hex().c_str(), wall_seconds, manifest.seconds.at("total"));
}

void Run(const BuildArguments& arguments, const CommandContext& context) {
  KeepFreedMemory(kBlocksOfABuild);
  CatchInterrupts();
  const auto start = std::chrono::steady_clock::now();
  const Study study = FromFile(arguments.study, ReadStudy);
  for (const StudyScan& scan : study.scans) RequireReadableDicom(scan.volume, "scan '" + scan.name + "'");
  RequireReadableSegments(study.bone_labels, "bones.labels", study.bones);
  RequireReadableSegments(study.bone_seeds, "bones.seeds");
  if (!arguments.artifacts.empty())
    WithName<InputError, Denied>("--artifacts", [&] { RequireMayFill(arguments.artifacts); });
  BuildOptions options;
  if (arguments.method == "paper") options.method = RegistrationMethod::kPaper;
  options.paper = arguments.paper;
  Backend backend(context.backend);
  ProgressBar bar(context.quiet);
  const ModelManifest manifest =
      BuildModel(study, options, arguments.out, arguments.artifacts, backend, bar.AsProgress());
  bar.Finish();
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  for (const std::string& warning : manifest.warnings) Warn(warning);
  if (context.json)
    PrintDocument(InfoJson(Model::Load(arguments.out, arguments.artifacts)));
  else
    PrintSummary(manifest, seconds);
}

}  // namespace

void AddBuild(CLI::App& program, CommandContext& context) {
  CLI::App* command = program.add_subcommand("build", "Build a model from the scans of a study");
  auto arguments = std::make_shared<BuildArguments>();
  command->add_option("study", arguments->study, "study.json")->required()->type_name("STUDY");
  AddOut(*command, arguments->out, "Folder of the model; a new one, or a model to bring up to date", "MODEL");
  command
      ->add_option(
          "--method", arguments->method,
          "adaptive: registration that stops block by block; paper: as published in 2011, to compare with "
          "(takes hours for a full-size scan)")
      ->check(CLI::IsMember({"adaptive", "paper"}))
      ->capture_default_str();
  AddPaperOptions(*command, arguments->paper);
  command
      ->add_option("--artifacts", arguments->artifacts,
                   "Folder of finished stages, to share between models (default: MODEL/artifacts)")
      ->type_name("DIR");
  AddComputing(*command, context);
  command->footer(
      "Finished stages are found again: an interrupted build goes on where it stopped.\n\n"
      "Examples:\n  kinevox build knee-a/study.json --out knee-a.model\n"
      "  kinevox build study.json --out m --method paper --max-blocks 200 --json");
  command->callback([arguments, command, &context] {
    RequirePaperMethod(*command, arguments->method);
    Run(*arguments, context);
  });
}

}  // namespace kvx
