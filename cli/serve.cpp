// kinevox serve: the service.
#include <CLI/CLI.hpp>
#include <charconv>
#include <cstdio>

#include "cli/commands.h"
#include "cli/stop_on_interrupt.h"
#include "server/log.h"
#include "server/service.h"

namespace kvx {
namespace {

struct ServeArguments {
  std::filesystem::path data = "kinevox-data";
  std::string listen = "127.0.0.1:8080", log = "info";
  int workers = 1;
  double result_cache_gib = 8, upload_gib = 4, lease_seconds = 15, memory_gib = 0;
  bool private_webhooks = false;
};

// "127.0.0.1:8080", "[::1]:0", ":8080" or "8080".
void ParseListen(const std::string& text, HttpOptions& http) {
  const size_t colon = text.rfind(':');
  std::string host = colon == text.npos ? "" : text.substr(0, colon);
  const std::string port = colon == text.npos ? text : text.substr(colon + 1);
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  const auto [end, error] = std::from_chars(port.data(), port.data() + port.size(), http.port);
  if (error != std::errc() || end != port.data() + port.size() || http.port < 0 || http.port > 65535) {
    throw UsageError("--listen takes HOST:PORT, as in 127.0.0.1:8080; port 0 is any free one");
  }
  if (!host.empty()) http.host = host;
  if (!IsLoopback(http.host)) {
    throw Refused("authentication is not available in this version, so the service listens on loopback only "
                  "(127.0.0.1 or ::1)");
  }
}

int64_t BytesOfGib(double gib) { return int64_t(gib * double(int64_t(1) << 30)); }

void Announce(const Service& service, const HttpOptions& http, const CommandContext& context) {
  const bool v6 = http.host.find(':') != std::string::npos;
  const std::string url = "http://" + (v6 ? "[" + http.host + "]" : http.host) + ":" + std::to_string(service.port());
  std::fprintf(stderr, "listening on %s\n", url.c_str());
  if (context.json) PrintDocument("{\"url\":\"" + url + "\",\"port\":" + std::to_string(service.port()) + "}");
}

void Run(const ServeArguments& arguments, const CommandContext& context) {
  ServiceOptions options;
  ParseListen(arguments.listen, options.http);
  options.data = arguments.data;
  options.workers = arguments.workers;
  options.backend = context.backend;
  options.result_cache_bytes = BytesOfGib(arguments.result_cache_gib);
  options.upload_quota_bytes = BytesOfGib(arguments.upload_gib);
  options.lease_ms = int64_t(arguments.lease_seconds * 1000);
  options.memory_bytes = BytesOfGib(arguments.memory_gib);
  options.webhooks.allow_private_addresses = arguments.private_webhooks;
  options.program = "/proc/self/exe";
  SetLogLevel(context.quiet ? "error" : arguments.log);
  CatchInterrupts();
  Service service(options);
  Announce(service, options.http, context);
  const StopOnInterrupt stopper([&service] { service.Stop(); });
  service.Run();
}

}  // namespace

void AddServe(CLI::App& program, CommandContext& context) {
  CLI::App* command = program.add_subcommand("serve", "Run the service: uploads, a queue of builds, posed volumes");
  auto arguments = std::make_shared<ServeArguments>();
  command->add_option("--data", arguments->data, "Folder of everything the service keeps")->capture_default_str();
  command->add_option("--listen", arguments->listen, "HOST:PORT, loopback only; port 0 is any free one")
      ->capture_default_str();
  command->add_option("--workers", arguments->workers, "Jobs at the same time in this process; 0: leave them to 'kinevox worker'")
      ->check(CLI::Range(0, 64))
      ->capture_default_str();
  command->add_option("--result-cache-gib", arguments->result_cache_gib, "Disk for posed volumes, in GiB")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--upload-limit-gib", arguments->upload_gib, "Largest upload, in GiB")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->add_option("--memory-gib", arguments->memory_gib,
                      "Memory that running jobs may declare together (default: most of the machine's)")
      ->check(CLI::NonNegativeNumber);
  command->add_option("--lease-seconds", arguments->lease_seconds, "A worker that is silent this long has lost its job")
      ->check(CLI::Range(0.5, 3600.0))
      ->capture_default_str();
  command->add_flag("--private-webhooks", arguments->private_webhooks,
                    "Let webhooks go to loopback and private addresses too");
  command->add_option("--log", arguments->log, "What is logged on stderr")
      ->check(CLI::IsMember({"info", "warn", "error", "off"}))
      ->capture_default_str();
  AddDevice(*command, context);
  AddJson(*command, context);
  command->footer(
      "Without authentication it listens on loopback only. SIGTERM stops it after the requests under way; builds go\n"
      "back to the queue and go on from their last finished stage at the next start.\n\n"
      "Examples:\n  kinevox serve --data /srv/kinevox\n  kinevox serve --listen 127.0.0.1:0 --json");
  command->callback([arguments, &context] { Run(*arguments, context); });
}

}  // namespace kvx
