// Every POST carries an Idempotency-Key, so one that lost its answer can be sent again.
#include "cli/service_client.h"

#include <unistd.h>

#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/interrupt.h"
#include "server/http_library.h"
#include "server/http_server.h"
#include "storage/ids.h"

namespace kvx {
namespace {

constexpr char kNoAnswer[] = "no kinevox service answers at this address; is 'kinevox serve' running there?";
constexpr int kTries = 3;

[[noreturn]] void ThrowProblem(int status, const std::string& body) {
  const ServiceJson problem = ServiceJson::parse(body, nullptr, false);
  std::string detail = "the service answered with status " + std::to_string(status);
  if (problem.is_object() && problem.contains("detail") && problem["detail"].is_string()) {
    detail = "the service says: " + problem["detail"].get<std::string>();
  }
  if (status == 404) throw NotFound(detail);
  if (status == 401 || status == 403 || status == 413 || status == 429) throw Refused(detail);
  if (status == 409) throw Conflict(detail);
  if (status >= 400 && status < 500) throw InputError(detail);
  throw Unavailable(detail);
}

ServiceJson Checked(const httplib::Result& result) {
  if (!result) {
    if (InterruptRequested()) throw Cancelled();
    throw Unavailable(kNoAnswer);
  }
  if (result->status >= 400) ThrowProblem(result->status, result->body);
  ServiceJson json = ServiceJson::parse(result->body, nullptr, false);
  if (json.is_discarded()) throw Unavailable("what answers at this address is not a kinevox service");
  return json;
}

httplib::Headers WithKey() { return {{"Idempotency-Key", NewId("key")}}; }

// Sends again when no answer came; the key makes that safe.
template <class Send>
ServiceJson SendKeyed(const Send& send) {
  const httplib::Headers headers = WithKey();
  httplib::Result result = send(headers);
  for (int tries = 1; !result && tries < kTries && !InterruptRequested(); ++tries) {
    if (result.error() == httplib::Error::Connection) break;  // nobody listens
    result = send(headers);
  }
  return Checked(result);
}

// From the environment: an argument of a command is seen by everybody on the machine.
void UseToken(httplib::Client& http, const std::string& url) {
  if (const char* authority = std::getenv("KINEVOX_CA")) http.set_ca_cert_path(authority);
  const char* token = std::getenv("KINEVOX_TOKEN");
  if (!token || !*token) return;
  const std::string host = url.substr(url.find("://") + 3);
  if (url.starts_with("http://") && !IsLoopback(host.substr(0, host.find_first_of(":/")))) {
    throw UsageError("a token is not sent in the clear: use an https:// address");
  }
  http.set_bearer_token_auth(token);
}

}  // namespace

std::string UrlEncoded(const std::string& text) { return httplib::encode_uri_component(text); }

struct ServiceClient::State {
  explicit State(const std::string& url) : http(url) {}
  httplib::Client http;
};

ServiceClient::ServiceClient(const std::string& url) {
  if (!url.starts_with("http://") && !url.starts_with("https://")) {
    throw UsageError("--server takes an address like http://127.0.0.1:8080");
  }
  state_ = std::make_unique<State>(url.ends_with('/') ? url.substr(0, url.size() - 1) : url);
  if (!state_->http.is_valid()) throw UsageError("--server takes an address like http://127.0.0.1:8080");
  state_->http.set_connection_timeout(5);
  state_->http.set_read_timeout(600);  // a large upload is read whole before it is answered
  state_->http.set_write_timeout(60);
  state_->http.set_tcp_nodelay(true);
  UseToken(state_->http, url);
}

ServiceClient::~ServiceClient() = default;

ServiceJson ServiceClient::Get(const std::string& path) { return Checked(state_->http.Get(path)); }
ServiceJson ServiceClient::Delete(const std::string& path) { return Checked(state_->http.Delete(path)); }

ServiceJson ServiceClient::Post(const std::string& path, const ServiceJson& body) {
  const std::string text = body.dump(-1, ' ', false, ServiceJson::error_handler_t::replace);
  return SendKeyed(
      [&](const httplib::Headers& headers) { return state_->http.Post(path, headers, text, "application/json"); });
}

ServiceJson ServiceClient::Upload(const std::string& path, const std::filesystem::path& file,
                                  const FractionSink& progress) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw InputError("a file of the study cannot be read");
  const size_t size = std::filesystem::file_size(file);
  const auto provide = [&](size_t offset, size_t length, httplib::DataSink& sink) {
    std::string chunk(std::min<size_t>(length, 1 << 18), '\0');
    in.clear();
    in.seekg(std::streamoff(offset));
    in.read(chunk.data(), std::streamsize(chunk.size()));
    progress(double(offset) / double(size));
    return in.gcount() > 0 && !InterruptRequested() && sink.write(chunk.data(), size_t(in.gcount()));
  };
  return SendKeyed([&](const httplib::Headers& headers) {
    return state_->http.Post(path, headers, size, provide, "application/octet-stream");
  });
}

void ServiceClient::Download(const std::string& path, const std::string& post_body, const std::filesystem::path& out,
                             const FractionSink& progress) {
  const std::filesystem::path temporary = out.string() + "." + std::to_string(getpid()) + ".part";
  std::ofstream file(temporary, std::ios::binary);
  if (!file) throw InputError("--out cannot be written; choose a place where you may write");
  int status = 0;
  size_t total = 0, received = 0;
  std::string problem;
  httplib::Request request;
  request.method = post_body.empty() ? "GET" : "POST";
  request.path = path;
  request.body = post_body;
  if (!post_body.empty()) request.set_header("Content-Type", "application/json");
  request.response_handler = [&](const httplib::Response& response) {
    status = response.status;
    total = response.get_header_value_u64("Content-Length");
    return true;
  };
  request.content_receiver = [&](const char* data, size_t size, size_t, size_t) {
    if (status >= 400) problem.append(data, size);
    else file.write(data, std::streamsize(size));
    received += size;
    if (total > 0) progress(double(received) / double(total));
    return bool(file) && !InterruptRequested();
  };
  const httplib::Result result = state_->http.send(request);
  file.close();
  std::error_code ignored;
  if (!result || status >= 400 || !file) std::filesystem::remove(temporary, ignored);
  if (InterruptRequested()) throw Cancelled();
  if (!result && status == 0) throw Unavailable(kNoAnswer);
  if (status >= 400) ThrowProblem(status, problem);
  if (!result || !file) throw Unavailable("the download broke off; is the disk full?");
  std::filesystem::rename(temporary, out);
}

}  // namespace kvx
