// One table says what there is; file, environment, command line and print-out all follow it.
#include "cli/options/service_config.h"

#include <toml++/toml.h>
#include <unistd.h>

#include <cstdlib>
#include <regex>
#include <set>
#include <sstream>
#include <string_view>
#include <variant>

#include "cli/commands.h"
#include "cli/options/named_files.h"
#include "core/text/parse_number.h"

namespace kvx {
namespace {

using SettingValue = std::variant<std::string*, int64_t*, double*, bool*, std::vector<std::string>*>;

// One setting, and where its value lies in a configuration.
struct Setting {
  std::string section, key;
  SettingValue value;
  std::string_view help;

  std::string Name() const { return section + "." + key; }
  std::string Variable() const {  // of the environment
    std::string name = "KINEVOX_" + section + "_" + key;
    for (char& c : name) c = char(std::toupper(static_cast<unsigned char>(c)));
    return name;
  }
};

int64_t BytesOfGib(double gib) { return int64_t(gib * double(int64_t(1) << 30)); }

template <class T>
bool Take(const std::optional<T>& found, T& value) {
  if (found) value = *found;
  return found.has_value();
}

std::optional<bool> ParseBool(const std::string& text) {
  if (text == "true" || text == "1") return true;
  if (text == "false" || text == "0") return false;
  return std::nullopt;
}

std::vector<std::string> Split(const std::string& text) {
  std::vector<std::string> parts;
  std::istringstream words(text);
  for (std::string part; std::getline(words, part, ',');) {
    if (!part.empty()) parts.push_back(part);
  }
  return parts;
}

bool SetFromText(const SettingValue& value, const std::string& text) {
  if (auto* const* as = std::get_if<std::string*>(&value)) return **as = text, true;
  if (auto* const* as = std::get_if<std::vector<std::string>*>(&value))
    return **as = Split(text), !text.starts_with('[');  // that is how the file writes a list
  if (auto* const* as = std::get_if<int64_t*>(&value)) return Take(ParseAs<int64_t>(text), **as);
  if (auto* const* as = std::get_if<double*>(&value)) return Take(ParseAs<double>(text), **as);
  return Take(ParseBool(text), *std::get<bool*>(value));
}

template <class T>
bool TakeExact(const toml::node& node, T& value) {
  return Take<T>(node.value_exact<T>(), value);
}

bool SetFromNode(const SettingValue& value, const toml::node& node) {
  if (auto* const* as = std::get_if<std::string*>(&value)) return TakeExact(node, **as);
  if (auto* const* as = std::get_if<int64_t*>(&value)) return TakeExact(node, **as);
  if (auto* const* as = std::get_if<bool*>(&value)) return TakeExact(node, **as);
  if (auto* const* as = std::get_if<double*>(&value)) {
    return node.is_number() && Take(node.value<double>(), **as);  // 4 for 4.0
  }
  const toml::array* list = node.as_array();
  if (!list) return false;
  std::vector<std::string>& texts = *std::get<std::vector<std::string>*>(value);
  texts.clear();
  for (const toml::node& item : *list) {
    if (!item.is_string()) return false;
    texts.push_back(*item.value<std::string>());
  }
  return true;
}

toml::array ArrayOf(const std::vector<std::string>& texts) {
  toml::array list;
  for (const std::string& text : texts) list.push_back(text);
  return list;
}

std::string TomlOf(const SettingValue& value) {
  std::ostringstream text;
  if (auto* const* as = std::get_if<std::string*>(&value)) text << toml::value<std::string>(**as);
  if (auto* const* as = std::get_if<int64_t*>(&value)) text << **as;
  if (auto* const* as = std::get_if<double*>(&value)) text << toml::value<double>(**as);
  if (auto* const* as = std::get_if<bool*>(&value)) text << (**as ? "true" : "false");
  if (auto* const* as = std::get_if<std::vector<std::string>*>(&value)) text << ArrayOf(**as);
  return text.str();
}

const char* KindOf(const SettingValue& value) {
  constexpr const char* kKinds[] = {"a text", "a whole number", "a number", "true or false",
                                    "a list of texts: [\"a\", \"b\"] in the file, a,b elsewhere"};
  return kKinds[value.index()];
}

const Setting& Find(const std::vector<Setting>& settings, const std::string& name) {
  for (const Setting& setting : settings) {
    if (setting.Name() == name) return setting;
  }
  throw InputError("there is no setting '" + name + "'; 'kinevox serve --print-config' lists them");
}

[[noreturn]] void ThrowKind(const Setting& setting) {
  throw InputError("the setting '" + setting.Name() + "' is " + KindOf(setting.value));
}

// Not a number is outside of every range.
void RequireRange(const char* name, double value, double low, double high) {
  if (value >= low && value <= high) return;
  std::ostringstream sentence;
  sentence << "the setting '" << name << "' is a number from " << low << " to " << high;
  throw InputError(sentence.str());
}

void RequireOrigin(const std::string& text) {
  static const std::regex kOrigin(R"(https?://([a-z0-9.-]+|\[[0-9a-f:]+\])(:[0-9]{1,5})?)");
  if (std::regex_match(text, kOrigin)) return;
  throw InputError(
      "the setting 'server.cors_origins' lists origins as browsers send them: https://viewer.example or "
      "http://localhost:3000, in small letters and without a path");
}

// Every request would be refused by a name that no Host header can be.
void RequireHost(const std::string& text) {
  static const std::regex kHost(R"([A-Za-z0-9_-]+(\.[A-Za-z0-9_-]+)*|[0-9A-Fa-f:]*:[0-9A-Fa-f:.]*)");
  if (std::regex_match(text, kHost)) return;
  throw InputError(
      "the setting 'server.hosts' lists names or addresses of hosts alone, as kinevox.example or 10.0.0.7: "
      "without http://, port, path and *");
}

// One that is misspelt or forgotten would leave the service open to all.
void RequireAllOf(const OidcOptions& oidc) {
  const bool any = !oidc.issuer.empty() || !oidc.audience.empty() || !oidc.jwks.empty();
  if (any && (oidc.issuer.empty() || oidc.audience.empty() || oidc.jwks.empty()))
    throw InputError(
        "OIDC needs all of the settings 'auth.oidc_issuer', 'auth.oidc_audience' and 'auth.oidc_jwks', or "
        "none of them");
}

constexpr double kMostGib = 1e9;

void Check(const ServiceConfig& c) {
  if (!std::set<std::string>{"info", "warn", "error", "off"}.contains(c.log))
    throw InputError("the setting 'server.log' is info, warn, error or off");
  RequireRange("server.workers", double(c.workers), 0, 64);
  RequireRange("server.drain_seconds", double(c.drain_seconds), 0, 3600);
  RequireRange("server.lease_seconds", c.lease_seconds, 0.5, 3600);
  RequireRange("limits.upload_gib", c.upload_gib, 1e-6, kMostGib);
  RequireRange("limits.result_cache_gib", c.result_cache_gib, 1e-6, kMostGib);
  RequireRange("limits.least_free_gib", c.least_free_gib, 0, kMostGib);
  RequireRange("limits.requests_per_minute", double(c.requests_per_minute), 0, 1e9);
  RequireRange("limits.gib_per_day", c.gib_per_day, 0, kMostGib);
  RequireRange("limits.memory_gib", c.memory_gib, 0, kMostGib);
  RequireRange("device.threads", double(c.threads), 0, 4096);
  for (const std::string& origin : c.cors_origins) RequireOrigin(origin);
  for (const std::string& host : c.hosts) RequireHost(host);
  RequireAllOf(c.oidc);
}

// "127.0.0.1:8080", "[::1]:0", ":8080" or "8080".
void ParseListen(const std::string& text, HttpOptions& http) {
  const size_t colon = text.rfind(':');
  std::string host = colon == text.npos ? "" : text.substr(0, colon);
  if (host.starts_with('[') && host.ends_with(']')) host = host.substr(1, host.size() - 2);
  const auto port = ParseAs<int>(colon == text.npos ? text : text.substr(colon + 1));
  if (!port || *port < 0 || *port > 65535)
    throw UsageError("--listen takes HOST:PORT, as in 127.0.0.1:8080; port 0 is any free one");
  http.port = *port;
  if (!host.empty()) http.host = host;
}

std::optional<int64_t> LimitOrNone(int64_t limit) { return limit > 0 ? std::optional(limit) : std::nullopt; }

std::vector<Setting> SettingsOf(ServiceConfig& c) {
  return {
      {"server", "data", &c.data, "folder of everything the service keeps"},
      {"server", "listen", &c.listen,
       "HOST:PORT; beyond loopback only with authentication and TLS or behind_proxy"},
      {"server", "workers", &c.workers,
       "jobs at the same time in this process; 0: leave them to kinevox worker"},
      {"server", "log", &c.log, "info, warn, error or off"},
      {"server", "behind_proxy", &c.behind_proxy, "a proxy with TLS stands in front"},
      {"server", "hosts", &c.hosts, "names it answers to; empty: any, once authentication is on"},
      {"server", "cors_origins", &c.cors_origins,
       "other origins whose pages may use it, as https://viewer.example"},
      {"server", "drain_seconds", &c.drain_seconds, "how long a stop waits for requests under way"},
      {"server", "lease_seconds", &c.lease_seconds, "a worker that is silent this long has lost its job"},
      {"tls", "certificate", &c.tls_certificate, "PEM file"},
      {"tls", "key", &c.tls_key, "PEM file"},
      {"auth", "api_keys", &c.api_keys, "ask for an API key (kinevox keys add)"},
      {"auth", "oidc_issuer", &c.oidc.issuer, "take tokens of this OpenID Connect issuer"},
      {"auth", "oidc_audience", &c.oidc.audience, "that are meant for this audience"},
      {"auth", "oidc_jwks", &c.oidc.jwks, "the issuer's keys: a file or an https address"},
      {"auth", "oidc_project_claim", &c.oidc.project_claim, "claim that names the project"},
      {"auth", "oidc_scope_claim", &c.oidc.scope_claim,
       "claim that holds kinevox.read, kinevox.write or kinevox.admin"},
      {"limits", "upload_gib", &c.upload_gib, "largest upload"},
      {"limits", "result_cache_gib", &c.result_cache_gib, "disk for posed volumes"},
      {"limits", "least_free_gib", &c.least_free_gib,
       "no uploads, no jobs and not ready when less of the disk is free"},
      {"limits", "requests_per_minute", &c.requests_per_minute,
       "of a key that has no limit of its own; 0: none"},
      {"limits", "gib_per_day", &c.gib_per_day, "uploaded by a key that has no limit of its own; 0: none"},
      {"limits", "memory_gib", &c.memory_gib,
       "that running jobs may declare together; 0: most of the machine's"},
      {"webhooks", "private_addresses", &c.private_webhooks,
       "let webhooks go to loopback and private addresses too"},
      {"audit", "reads", &c.audit_reads, "reading goes into the audit trail too"},
      {"device", "name", &c.device,
       "OpenCL device: part of its name, or its number; empty: the first GPU, else the first"},
      {"device", "threads", &c.threads, "threads to compute with; 0: all"},
  };
}

// KINEVOX_SERVER_WORKER is a slip of the pen; KINEVOX_PORT_80_TCP may be an orchestrator's.
void RequireMeant(ServiceConfig& config, std::string_view entry) {
  const std::string name(entry.substr(0, entry.find('=')));
  static const std::set<std::string> kOthers{"KINEVOX_CONFIG", "KINEVOX_TOKEN", "KINEVOX_CA"};
  if (!name.starts_with("KINEVOX_") || kOthers.contains(name)) return;
  bool section = false;
  for (const Setting& setting : SettingsOf(config)) {
    if (setting.Variable() == name) return;
    section |= name.starts_with(Setting{setting.section, "", {}, ""}.Variable());
  }
  const std::string sentence =
      "there is no setting for the environment's " + name + "; 'kinevox serve --print-config' lists them";
  if (section) throw InputError(sentence);
  Warn(sentence);
}

}  // namespace

void ServiceConfig::Set(const std::string& name, const std::string& text) {
  const auto settings = SettingsOf(*this);
  const Setting& setting = Find(settings, name);
  if (!SetFromText(setting.value, text)) ThrowKind(setting);
}

void ServiceConfig::ReadFile(const std::filesystem::path& file) {
  toml::table table;
  try {
    table = toml::parse(ContentOf(file));
  } catch (const toml::parse_error& error) {
    throw InputError("the configuration file is not TOML: line " + std::to_string(error.source().begin.line));
  }
  const auto settings = SettingsOf(*this);
  for (const auto& [section, content] : table) {
    const toml::table* keys = content.as_table();
    if (!keys)
      throw InputError("the setting '" + std::string(section.str()) + "' stands outside of a [section]");
    for (const auto& [key, node] : *keys) {
      const Setting& setting = Find(settings, std::string(section.str()) + "." + std::string(key.str()));
      if (!SetFromNode(setting.value, node)) ThrowKind(setting);
    }
  }
}

void ServiceConfig::ReadEnvironment() {
  for (const Setting& setting : SettingsOf(*this)) {
    const char* text = std::getenv(setting.Variable().c_str());
    if (text && !SetFromText(setting.value, text)) ThrowKind(setting);
  }
  for (char** entry = environ; *entry; ++entry) RequireMeant(*this, *entry);
}

std::string ServiceConfig::AsToml() const {
  ServiceConfig copy = *this;
  std::string text, section;
  for (const Setting& setting : SettingsOf(copy)) {
    if (setting.section != section) text += (section.empty() ? "[" : "\n[") + setting.section + "]\n";
    section = setting.section;
    text += setting.key + " = " + TomlOf(setting.value) + "  # " + std::string(setting.help) + "\n";
  }
  return text;
}

ServiceOptions ServiceConfig::Options() const {
  Check(*this);
  ServiceOptions options;
  ParseListen(listen, options.http);
  options.data = data;
  options.workers = int(workers);
  options.result_cache_bytes = BytesOfGib(result_cache_gib);
  options.upload_quota_bytes = BytesOfGib(upload_gib);
  options.least_free_bytes = uintmax_t(BytesOfGib(least_free_gib));
  options.lease_ms = int64_t(lease_seconds * 1000);
  options.memory_bytes = BytesOfGib(memory_gib);
  options.webhooks.allow_private_addresses = private_webhooks;
  options.program = "/proc/self/exe";
  options.backend.device = device;
  options.backend.threads = int(threads);
  HttpOptions& http = options.http;
  http.access = {api_keys, oidc, {LimitOrNone(requests_per_minute), LimitOrNone(BytesOfGib(gib_per_day))}};
  http.tls_certificate = tls_certificate;
  http.tls_key = tls_key;
  http.behind_proxy = behind_proxy;
  http.hosts = hosts;
  http.cors_origins = cors_origins;
  http.audit_reads = audit_reads;
  http.drain_seconds = int(drain_seconds);
  return options;
}

}  // namespace kvx
