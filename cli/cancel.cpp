// kinevox cancel: jobs and batches that need not end.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/service/asked_jobs.h"

namespace kvx {
namespace {

struct CancelArguments {
  std::string server;
  std::vector<std::string> ids;
};

ServiceJson NotCancelled(const std::string& id, const Error& error) {
  return {{"id", id}, {"state", "not cancelled"}, {"error", {{"detail", error.what()}}}};
}

// What became of one: the service's answer, or {"id", "state": "not cancelled", "error"}. `broke`: why those
// after it are not asked for.
ServiceJson Cancel(ServiceClient& client, const std::string& id, std::exception_ptr& broke) {
  try {
    if (broke) std::rethrow_exception(broke);
    return client.Delete(AddressOf(id));
  } catch (const Error& error) {
    const bool of_this_one = IsOneOf<Conflict, NotFound>(error),
               of_all = IsOneOf<Unavailable, Refused>(error);
    if (!of_this_one && !of_all) throw;
    if (of_all) broke = std::current_exception();
    return NotCancelled(id, error);
  }
}

std::string TaleOf(const std::string& id, const ServiceJson& answer) {
  if (answer.contains("error") && answer["state"] == "not cancelled") return answer["error"]["detail"];
  if (IsBatch(id)) return "cancelling";
  return answer["state"] == "cancelled" ? "cancelled" : "stopping";
}

void Run(const CancelArguments& arguments, const CommandContext& context) {
  ServiceClient client(arguments.server);
  if (!context.quiet) client.OnWait(TellOnStderr());
  ServiceJson answers = ServiceJson::array();
  size_t refused = 0;
  std::exception_ptr broke;
  for (const std::string& id : arguments.ids) {
    const bool alone = arguments.ids.size() == 1;
    answers.push_back(alone ? client.Delete(AddressOf(id)) : Cancel(client, id, broke));
    refused += answers.back()["state"] == "not cancelled";
    if (!context.json) std::printf("%s  %s\n", id.c_str(), TaleOf(id, answers.back()).c_str());
  }
  if (context.json) PrintDocument(answers.dump(1));
  if (broke) std::rethrow_exception(broke);
  if (refused > 0) {
    throw Conflict(std::to_string(refused) + " of " + std::to_string(arguments.ids.size()) +
                   " were not cancelled");
  }
}

}  // namespace

void AddCancel(CLI::App& program, CommandContext& context) {
  CLI::App* command = program.add_subcommand("cancel", "Cancel jobs or whole batches on the service");
  auto arguments = std::make_shared<CancelArguments>();
  command->add_option("ids", arguments->ids, "job_... or bat_...")->required()->type_name("ID");
  AddServer(*command, arguments->server);
  AddQuiet(*command, context);
  AddJson(*command, context);
  command->footer(
      "One that has ended or is not there does not stop the others; the exit code is 4 then. A service that "
      "is busy or does not answer is asked again for two minutes.\n\n"
      "Examples:\n  kinevox cancel job_4x9...\n  kinevox cancel bat_7d2...");
  command->callback([arguments, &context] { Run(*arguments, context); });
}

}  // namespace kvx
