// kinevox serve: the service.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <map>

#include "cli/commands.h"
#include "cli/options/named_files.h"
#include "cli/options/service_config.h"
#include "cli/service/data_folder_records.h"
#include "cli/terminal/open_files.h"
#include "cli/terminal/stop_on_interrupt.h"
#include "server/address.h"
#include "server/log.h"

namespace kvx {
namespace {

// Options of the command line by the setting each of them overrules, as text.
struct ServeArguments {
  std::string config;
  std::map<std::string, std::string> settings;  // what was given
  std::vector<std::string> set;                 // SECTION.KEY=VALUE
  bool print_config = false;
};

ServiceConfig ConfigOf(const ServeArguments& arguments, const CommandContext& context) {
  ServiceConfig config;
  const char* named = std::getenv("KINEVOX_CONFIG");
  const std::string file = !arguments.config.empty() ? arguments.config : named ? named : "";
  if (!file.empty()) FromFile(file, [&](const std::filesystem::path& path) { config.ReadFile(path); });
  config.ReadEnvironment();
  for (const auto& [name, text] : arguments.settings) {
    if (!text.empty()) config.Set(name, text);
  }
  for (const std::string& item : arguments.set) {
    const size_t equals = item.find('=');
    if (equals == item.npos) throw UsageError("--set takes SECTION.KEY=VALUE");
    config.Set(item.substr(0, equals), item.substr(equals + 1));
  }
  if (!context.backend.device.empty()) config.device = context.backend.device;
  if (context.backend.threads > 0) config.threads = context.backend.threads;
  return config;
}

void Announce(const Service& service, const HttpOptions& http, const CommandContext& context) {
  const bool v6 = http.host.find(':') != std::string::npos;
  const std::string url = std::string(http.Tls() ? "https://" : "http://") +
                          (v6 ? "[" + http.host + "]" : http.host) + ":" + std::to_string(service.port());
  std::fprintf(stderr, "listening on %s\n", url.c_str());
  if (context.json)
    PrintDocument("{\"url\":\"" + url + "\",\"port\":" + std::to_string(service.port()) + "}");
}

void Run(const ServeArguments& arguments, const CommandContext& context) {
  const ServiceConfig config = ConfigOf(arguments, context);
  const ServiceOptions options = config.Options();
  if (arguments.print_config) return PrintDocument(config.AsToml());
  if (!IsLoopback(options.http.host) && !options.http.access.On()) {
    throw InputError(
        "without authentication the service listens on loopback only (127.0.0.1 or ::1); "
        "--set auth.api_keys=true turns API keys on");
  }
  for (const std::string& pem : {config.tls_certificate, config.tls_key})
    if (!pem.empty()) RequireThere(pem);
  RequireDataFolderOrEmpty(options.data);
  SetLogLevel(context.quiet ? "error" : config.log);
  AllowManyOpenFiles();
  CatchInterrupts();
  Service service(options);
  Announce(service, options.http, context);
  const StopOnInterrupt stopper([&service] { service.Stop(); });
  service.Run();
}

// An option that overrules one setting of the configuration.
CLI::Option* AddSetting(CLI::App& command, ServeArguments& arguments, const std::string& flags,
                        const std::string& type, const std::string& setting, const std::string& help) {
  return command.add_option(flags, arguments.settings[setting], help)->type_name(type);
}

// `a` outlives the command.
void AddSettings(CLI::App& command, ServeArguments& a) {
  AddSetting(command, a, "--data", "DIR", "server.data",
             "Folder of everything the service keeps (default: kinevox-data)");
  AddSetting(command, a, "--listen", "HOST:PORT", "server.listen",
             "HOST:PORT (default: 127.0.0.1:8080); port 0 is any free one");
  AddSetting(command, a, "--workers", "N", "server.workers",
             "Jobs at the same time in this process (default: 1); 0: leave them to 'kinevox worker'")
      ->check(CLI::Range(0, 64));
  AddSetting(command, a, "--result-cache-gib", "GIB", "limits.result_cache_gib",
             "Disk for posed volumes, in GiB (default: 8)")
      ->check(AboveZero());
  AddSetting(command, a, "--upload-limit-gib", "GIB", "limits.upload_gib",
             "Largest upload, in GiB (default: 4)")
      ->check(AboveZero());
  AddSetting(command, a, "--memory-gib", "GIB", "limits.memory_gib",
             "Memory that running jobs may declare together (default: most of the machine's)")
      ->check(ZeroOrAbove());
  AddSetting(command, a, "--lease-seconds", "S", "server.lease_seconds",
             "A worker that is silent this long has lost its job (default: 15)")
      ->check(CLI::Range(0.5, 3600.0));
  command.add_flag_callback(
      "--private-webhooks", [&a] { a.settings["webhooks.private_addresses"] = "true"; },
      "Let webhooks go to loopback and private addresses too");
  AddSetting(command, a, "--tls-certificate", "FILE", "tls.certificate", "PEM file: speak TLS");
  AddSetting(command, a, "--tls-key", "FILE", "tls.key", "PEM file of the certificate's key");
  AddSetting(command, a, "--log", "TEXT", "server.log", "What is logged on stderr (default: info)")
      ->check(CLI::IsMember({"info", "warn", "error", "off"}));
}

}  // namespace

void AddServe(CLI::App& program, CommandContext& context) {
  CLI::App* command =
      program.add_subcommand("serve", "Run the service: uploads, a queue of builds, posed volumes");
  auto arguments = std::make_shared<ServeArguments>();
  ServeArguments& a = *arguments;
  command->add_option("--config", a.config, "Configuration file (TOML); also $KINEVOX_CONFIG")
      ->type_name("FILE");
  command
      ->add_option("--set", a.set,
                   "SECTION.KEY=VALUE of the configuration, any number of times; lists with commas: "
                   "server.cors_origins=https://a.example,https://b.example")
      ->type_name("SETTING");
  command->add_flag("--print-config", a.print_config,
                    "Print the configuration as it would be, and what each setting means");
  AddSettings(*command, a);
  AddDevice(*command, context);
  command->add_flag("--quiet", context.quiet, "As --log error");
  AddJson(*command, context);
  command->footer(
      "Settings come from the file, then the environment (KINEVOX_AUTH_API_KEYS=true), then the command "
      "line.\n"
      "Without authentication it listens on loopback only. SIGTERM stops it after the requests under way; "
      "builds go back to the queue and go on from their last finished stage at the next start.\n\n"
      "Examples:\n  kinevox serve --data /srv/kinevox\n  kinevox serve --listen 127.0.0.1:0 --json\n"
      "  kinevox serve --config /etc/kinevox.toml --print-config");
  command->callback([arguments, &context] { Run(*arguments, context); });
}

}  // namespace kvx
