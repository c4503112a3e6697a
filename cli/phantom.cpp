// kinevox phantom: a synthetic study with known truth.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/terminal/interrupt.h"
#include "cli/terminal/progress_bar.h"
#include "pipeline/phantom/write_phantom.h"

namespace kvx {
namespace {

struct PhantomArguments {
  std::string region, scale = "full";
  std::filesystem::path out;
  PhantomOptions options;
};

void Run(PhantomArguments& arguments, const CommandContext& context) {
  CatchInterrupts();
  arguments.options.region = arguments.region == "hand" ? Region::kHand : Region::kKnee;
  arguments.options.half_scale = arguments.scale == "half";
  ProgressBar bar(context.quiet);
  const std::vector<std::string> warnings = WritePhantom(arguments.options, arguments.out, bar.AsProgress());
  bar.Finish();
  for (const std::string& warning : warnings) Warn(warning);
  const std::string study = (arguments.out / "study.json").string();
  if (context.json)
    return PrintDocument(nlohmann::ordered_json{{"study", study}, {"warnings", warnings}}.dump(
        1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));  // a path need not be UTF-8
  std::fprintf(stderr, "a %s phantom was written; next: kinevox build %s --out MODEL\n",
               arguments.region.c_str(), study.c_str());
}

}  // namespace

void AddPhantom(CLI::App& program, CommandContext& context) {
  CLI::App* command = program.add_subcommand("phantom", "Write a synthetic study with exact truth");
  auto arguments = std::make_shared<PhantomArguments>();
  command->add_option("region", arguments->region, "hand or knee")
      ->required()
      ->check(CLI::IsMember({"hand", "knee"}));
  AddOut(*command, arguments->out, "Folder to write into", "DIR");
  command->add_option("--seed", arguments->options.seed, "Anatomy, poses, texture and noise follow from it")
      ->transform(WholeUpTo(std::numeric_limits<uint64_t>::max()))
      ->capture_default_str();
  command
      ->add_option("--scale", arguments->scale,
                   "full: the paper's scan sizes; half: half the resolution along every axis")
      ->check(CLI::IsMember({"full", "half"}))
      ->capture_default_str();
  AddQuiet(*command, context);
  AddJson(*command, context);
  command->footer("Example:\n  kinevox phantom knee --out knee --scale half --seed 7");
  command->callback([arguments, &context] { Run(*arguments, context); });
}

}  // namespace kvx
