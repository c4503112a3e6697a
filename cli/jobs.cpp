// kinevox jobs: what the service is doing.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/service/asked_jobs.h"

namespace kvx {
namespace {

struct JobsArguments {
  std::string server, id;
  int limit = 50;
  bool cancel = false;
};

// A segmentation belongs to no model.
void PrintJob(const ServiceJson& job) {
  const std::string model = job["model"].is_string() ? job["model"].get<std::string>() : "-";
  std::printf("%s  %-9s %3.0f %%  %-24s %s", job["id"].get_ref<const std::string&>().c_str(),
              job["state"].get_ref<const std::string&>().c_str(), 100 * job["progress"].get<double>(),
              job["stage"].get_ref<const std::string&>().c_str(), model.c_str());
  if (job.contains("subject_name"))
    std::printf("  %s", job["subject_name"].get_ref<const std::string&>().c_str());
  if (job.contains("error")) std::printf("  %s", job["error"].value("detail", "").c_str());
  const std::string warnings = CountedWarnings(WarningsOf(job).size());
  std::printf("%s%s\n", warnings.empty() ? "" : "  ", warnings.c_str());
}

// What a batch says of each of its jobs, as the job itself would.
ServiceJson JobsOf(const ServiceJson& batch) {
  ServiceJson jobs = ServiceJson::array();
  for (const ServiceJson& model : batch["models"]) {
    ServiceJson job = model;
    job["id"] = model["job"], job["model"] = model["id"];
    jobs.push_back(job);
  }
  return jobs;
}

void Run(const JobsArguments& arguments, const CommandContext& context) {
  if (arguments.cancel && arguments.id.empty()) throw UsageError("--cancel needs the ID of a job or batch");
  ServiceClient client(arguments.server);
  if (!context.quiet) client.OnWait(TellOnStderr());
  const std::string one = AddressOf(arguments.id);
  const ServiceJson answer = arguments.cancel ? client.Delete(one)
                             : !arguments.id.empty()
                                 ? client.GetPatiently(one)
                                 : client.GetPatiently("/v1/jobs?limit=" + std::to_string(arguments.limit));
  if (context.json) return PrintDocument(answer.dump(1));
  const bool of_batch = IsBatch(arguments.id);
  if (!of_batch && !answer.contains("items")) {
    PrintJob(answer);
    return TellWarnings(answer);
  }
  for (const ServiceJson& job : of_batch ? JobsOf(answer) : answer["items"]) PrintJob(job);
}

}  // namespace

void AddJobs(CLI::App& program, CommandContext& context) {
  CLI::App* command =
      program.add_subcommand("jobs", "List the service's jobs, show one or those of a batch, or cancel them");
  auto arguments = std::make_shared<JobsArguments>();
  command->add_option("id", arguments->id, "One job only, or those of a batch")->type_name("ID");
  AddServer(*command, arguments->server);
  command->add_option("--limit", arguments->limit, "How many, newest first")
      ->check(CLI::Range(1, 200))
      ->capture_default_str()
      ->type_name("N");
  command->add_flag("--cancel", arguments->cancel, "Cancel the job or batch, as 'kinevox cancel ID' does");
  AddQuiet(*command, context);
  AddJson(*command, context);
  command->footer("Examples:\n  kinevox jobs\n  kinevox jobs job_4x9... --cancel\n  kinevox jobs bat_7d2...");
  command->callback([arguments, &context] { Run(*arguments, context); });
}

}  // namespace kvx
