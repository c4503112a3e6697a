// kinevox cancel: jobs and batches that need not end.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/service_client.h"

namespace kvx {
namespace {

struct CancelArguments {
  std::string server = "http://127.0.0.1:8080";
  std::vector<std::string> ids;
};

void Run(const CancelArguments& arguments, const CommandContext& context) {
  ServiceClient client(arguments.server);
  ServiceJson answers = ServiceJson::array();
  for (const std::string& id : arguments.ids) {
    const bool batch = id.starts_with("bat_");
    answers.push_back(client.Delete((batch ? "/v1/batches/" : "/v1/jobs/") + UrlEncoded(id)));
    const ServiceJson& last = answers.back();
    if (!context.json)
      std::printf("%s  %s\n", id.c_str(),
                  batch                          ? "cancelling"
                  : last["state"] == "cancelled" ? "cancelled"
                                                 : "stopping");
  }
  if (context.json) PrintDocument(answers.dump(1));
}

}  // namespace

void AddCancel(CLI::App& program, CommandContext& context) {
  CLI::App* command = program.add_subcommand("cancel", "Cancel jobs or whole batches on the service");
  auto arguments = std::make_shared<CancelArguments>();
  command->add_option("ids", arguments->ids, "job_... or bat_...")->required()->type_name("ID");
  AddServer(*command, arguments->server);
  AddJson(*command, context);
  command->footer("Examples:\n  kinevox cancel job_4x9...\n  kinevox cancel bat_7d2...");
  command->callback([arguments, &context] { Run(*arguments, context); });
}

}  // namespace kvx
