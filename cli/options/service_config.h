// The service's configuration: a TOML file, then the environment, then the command line; each overrules the
// one before.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "server/service.h"

namespace kvx {

struct ServiceConfig {
  std::string data = "kinevox-data", listen = "127.0.0.1:8080", log = "info";
  int64_t workers = 1;
  double lease_seconds = 15, memory_gib = 0;
  bool private_webhooks = false;
  bool behind_proxy = false;
  std::vector<std::string> hosts, cors_origins;
  std::string tls_certificate, tls_key;
  bool api_keys = false;
  OidcOptions oidc;
  double upload_gib = 4, result_cache_gib = 8, least_free_gib = 0.5;
  int64_t requests_per_minute = 0, drain_seconds = 20;
  double gib_per_day = 0;
  bool audit_reads = false;
  std::string device;
  int64_t threads = 0;

  // The one setting of this name ("auth.api_keys") takes the text. Throws InputError naming it.
  void Set(const std::string& name, const std::string& text);
  void ReadFile(const std::filesystem::path& file);  // throws InputError naming line or setting, Denied
  void ReadEnvironment();                            // KINEVOX_AUTH_API_KEYS=true, lists with commas
  std::string AsToml() const;                        // with what each setting means
  ServiceOptions Options() const;                    // throws InputError for settings that cannot work
};

}  // namespace kvx
