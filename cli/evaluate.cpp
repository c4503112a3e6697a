// kinevox evaluate: the paper's tables for one model.
#include "pipeline/evaluate/evaluate.h"

#include <CLI/CLI.hpp>

#include "cli/commands.h"
#include "cli/options/named_files.h"
#include "cli/terminal/interrupt.h"
#include "cli/terminal/progress_bar.h"
#include "pipeline/evaluate/pictures.h"
#include "pipeline/evaluate/report.h"

namespace kvx {
namespace {

struct EvaluateArguments {
  std::filesystem::path model, truth, pictures;
  bool leave_one_out = false;
};

void Print(const Evaluation& evaluation, bool json) {
  for (const std::string& warning : evaluation.warnings) Warn(warning);
  PrintDocument(json ? EvaluationJson(evaluation) : EvaluationText(evaluation));
}

// Tables come first: a folder that fills up does not lose them.
void Run(const EvaluateArguments& arguments, const CommandContext& context) {
  CatchInterrupts();
  std::optional<Truth> truth;
  if (!arguments.truth.empty()) truth = FromFile(arguments.truth, ReadTruth);
  const Model model = Model::Load(arguments.model);
  const bool pictures = !arguments.pictures.empty();
  if (pictures) RequireMayFill(arguments.pictures);
  Backend backend(context.backend);
  ProgressBar bar(context.quiet);
  const Progress progress = bar.AsProgress();
  std::unique_ptr<PosingEngine> engine;
  if (truth || arguments.leave_one_out || pictures) engine = model.MakeEngine(backend);
  Evaluation evaluation =
      Evaluate(backend, model, engine.get(), truth ? &*truth : nullptr, progress.Part(0.0, 0.5));
  if (arguments.leave_one_out) evaluation.left_out = LeaveOneOut(model, *engine, progress.Part(0.5, 0.7));
  bar.Finish();
  Print(evaluation, context.json);
  if (!pictures) return;
  WithName<InputError, Denied, Unavailable>(arguments.pictures.string(), [&] {
    WritePictures(model, *engine, arguments.pictures, progress.Part(0.7, 1.0));
  });
}

}  // namespace

void AddEvaluate(CLI::App& program, CommandContext& context) {
  CLI::App* command = program.add_subcommand("evaluate", "The paper's tables for a model");
  auto arguments = std::make_shared<EvaluateArguments>();
  AddModelFolder(*command, arguments->model);
  command
      ->add_option(
          "--truth", arguments->truth,
          "Folder of a phantom: manifest.json and truth/poseNN_points.npz; the study's scans have the "
          "names of its files (pose00, pose01)")
      ->type_name("DIR");
  command->add_flag("--leave-one-out", arguments->leave_one_out,
                    "Predict each scan from the others and compare with its registered correspondence");
  command
      ->add_option(
          "--pictures", arguments->pictures,
          "Folder for one PNG per scan: template, scan, bones alone, registered, and both over the scan "
          "(scan green, model magenta)")
      ->type_name("DIR");
  AddComputing(*command, context);
  command->footer(
      "Examples:\n  kinevox evaluate knee.model\n"
      "  kinevox evaluate knee.model --truth knee/ --pictures pictures/ --json");
  command->callback([arguments, &context] { Run(*arguments, context); });
}

}  // namespace kvx
