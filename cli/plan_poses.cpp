// kinevox plan-poses: how many poses a motion needs, and which one to scan next.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/options/motion_options.h"
#include "cli/options/pose_options.h"
#include "pipeline/model/model.h"
#include "pipeline/posing/pose_plan.h"

namespace kvx {
namespace {

constexpr int kMostPoses = 400;  // of the motion that are looked at

struct PlanArguments {
  std::filesystem::path model;
  MotionOptions motion;
  double share = 0.9;
  int scans = 3;
};

nlohmann::ordered_json JointsOf(const Model& model, const JointAngles& angles) {
  nlohmann::ordered_json joints;
  const std::vector<std::string> names = model.fit().skeleton.DofNames(model.bone_names());
  for (size_t d = 0; d < names.size(); ++d)
    joints[names[d]] = std::round(DegFromRad(angles[Eigen::Index(d)]) * 10) / 10;
  return joints;
}

void Run(const PlanArguments& arguments, const CommandContext& context) {
  const KeyFrames frames = arguments.motion.Read();
  const Model model = Model::Load(arguments.model);
  WarnOfMotion(model, frames);
  std::vector<double> times_s;
  const std::vector<JointAngles> poses = AnglesAlong(model.Resolver(), frames, kMostPoses, times_s);
  const PosePlan plan = PlanPoses(model.space(), poses, arguments.scans);
  const int needed = EigenposesFor(plan, arguments.share);
  nlohmann::ordered_json next = nlohmann::ordered_json::array();
  for (const ProposedScan& scan : plan.next) {
    next.push_back({{"time", times_s[size_t(scan.pose)]},
                    {"uncertainty_after", scan.uncertainty_after},
                    {"joints", JointsOf(model, poses[size_t(scan.pose)])}});
  }
  if (context.json) {
    return PrintDocument(nlohmann::ordered_json{
        {"poses", poses.size()},
        {"share", arguments.share},
        {"eigenposes", needed},
        {"explained", plan.explained},
        {"scans", model.scan_names().size() + 1},
        {"uncertainty", plan.uncertainty},
        {"next", next}}.dump(1));
  }
  std::printf(
      "%zu poses of the motion; %d eigenposes hold %.0f %% of their variation. The model has %zu scans.\n",
      poses.size(), needed, 100 * arguments.share, model.scan_names().size() + 1);
  std::printf(
      "uncertainty now %.2f (how far off soft tissue is expected to be, in shares of what the scans taught "
      "beyond skinning; 0: every pose is an example)\n",
      plan.uncertainty);
  for (size_t n = 0; n < plan.next.size(); ++n) {
    std::printf("scan next, %zu: time %.3f s, uncertainty then %.2f: %s\n", n + 1,
                times_s[size_t(plan.next[n].pose)], plan.next[n].uncertainty_after,
                next[n]["joints"].dump().c_str());
  }
  if (int(plan.next.size()) < arguments.scans)
    std::printf("no %spose of the motion would tell the model much\n", plan.next.empty() ? "" : "further ");
}

}  // namespace

void AddPlanPoses(CLI::App& program, CommandContext& context) {
  CLI::App* command =
      program.add_subcommand("plan-poses", "How many poses a motion needs, and which to scan next");
  auto arguments = std::make_shared<PlanArguments>();
  AddModelFolder(*command, arguments->model);
  AddMotionOptions(*command, arguments->motion, "--motion");
  command->add_option("--share", arguments->share, "Of the variation that the eigenposes must hold")
      ->check(CLI::Range(0.01, 1.0))
      ->capture_default_str();
  command->add_option("--propose", arguments->scans, "How many poses to propose at most")
      ->check(CLI::Range(0, 20))
      ->capture_default_str();
  AddQuiet(*command, context);
  AddJson(*command, context);
  command->footer("Example:\n  kinevox plan-poses hand.model --motion grasp.csv --propose 2");
  command->callback([arguments, &context] { Run(*arguments, context); });
}

}  // namespace kvx
