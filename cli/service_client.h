// The HTTP client of the service's subcommands: JSON, uploads and downloads; problem documents become our errors.
#pragma once
#include <filesystem>
#include <functional>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>

namespace kvx {

using ServiceJson = nlohmann::ordered_json;
using FractionSink = std::function<void(double)>;

std::string UrlEncoded(const std::string& text);

class ServiceClient {
 public:
  explicit ServiceClient(const std::string& url);  // http://host:port; throws UsageError
  ~ServiceClient();

  // 400 -> InputError, 404 -> NotFound, 401, 403, 413, 429 -> Refused, 409 -> Conflict, others and no answer -> Unavailable.
  ServiceJson Get(const std::string& path);
  ServiceJson Delete(const std::string& path);
  ServiceJson Post(const std::string& path, const ServiceJson& body);
  ServiceJson Upload(const std::string& path, const std::filesystem::path& file, const FractionSink& progress);
  // `post_body` empty: GET. Written under a temporary name, then renamed.
  void Download(const std::string& path, const std::string& post_body, const std::filesystem::path& out,
                const FractionSink& progress);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kvx
