// Every POST carries an Idempotency-Key, so one that lost its answer can be sent again.
#include "cli/service_client.h"

#include <chrono>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "cli/commands.h"
#include "cli/interrupt.h"
#include "cli/named_files.h"
#include "cli/patience.h"
#include "core/base64.h"
#include "core/digest.h"
#include "pipeline/io/atomic_file.h"
#include "server/address.h"
#include "server/http_library.h"
#include "storage/ids.h"

namespace kvx {
namespace {

constexpr char kNoAnswer[] = "no kinevox service answers at this address; is 'kinevox serve' running there?";
constexpr char kNotWritten[] = "the download cannot be written; is the disk full?";
constexpr size_t kPartBytes = size_t(32) << 20;

[[noreturn]] void ThrowNoAnswer(httplib::Error error) {
  switch (error) {
    case httplib::Error::SSLServerVerification:
    case httplib::Error::SSLServerHostnameVerification:
    case httplib::Error::SSLLoadingCerts:
      throw Unavailable(
          "the certificate of the service is not trusted, or is for another name; KINEVOX_CA names the PEM "
          "file of the authority that signed it");
    case httplib::Error::SSLConnection:
      throw Unavailable("no TLS is spoken at this address; is it an http:// address?");
    default:
      throw NoAnswer(kNoAnswer);
  }
}

// What a problem document says; empty: it is none.
std::string DetailIn(const std::string& body) {
  const ServiceJson problem = ServiceJson::parse(body, nullptr, false);
  if (!problem.is_object() || !problem.contains("detail") || !problem["detail"].is_string()) return "";
  return problem["detail"].get<std::string>();
}

std::string StatusOnly(int status) { return "the service answered with status " + std::to_string(status); }

// "45 s", "90 min", "20 h"; never too early.
std::string InWords(uint64_t seconds) {
  if (seconds <= 120) return std::to_string(seconds) + " s";
  const uint64_t minutes = (seconds + 59) / 60;
  return minutes <= 120 ? std::to_string(minutes) + " min" : std::to_string((minutes + 59) / 60) + " h";
}

// `retry_after` is the header of this name, in seconds; 0: it was not there.
[[noreturn]] void ThrowProblem(int status, const std::string& body, uint64_t retry_after = 0) {
  const std::string told = DetailIn(body);
  std::string detail = told.empty() ? StatusOnly(status) : "the service says: " + told;
  if (status == 429 && retry_after > 0) detail += ": in " + InWords(retry_after);
  if (status == 401) detail += " (kinevox takes it from the variable KINEVOX_TOKEN)";
  if (status == 404) throw NotFound(detail);
  if (status == 413) throw TooLarge(detail);
  if (status == 401 || status == 403 || status == 429) throw Refused(detail);
  if (status == 409) throw Conflict(detail);
  if (status >= 400 && status < 500) throw InputError(detail);
  throw Unavailable(detail);
}

[[noreturn]] void ThrowProblem(const httplib::Response& response) {
  ThrowProblem(response.status, response.body, response.get_header_value_u64("Retry-After"));
}

[[noreturn]] void ThrowGivenUp(const httplib::Result& result) {
  if (!result) ThrowNoAnswer(result.error());
  ThrowProblem(*result);
}

ServiceJson Checked(const httplib::Result& result) {
  if (!result && InterruptRequested()) throw Cancelled();
  if (!result || result->status >= 400) ThrowGivenUp(result);
  ServiceJson json = ServiceJson::parse(result->body, nullptr, false);
  if (json.is_discarded()) throw Unavailable("what answers at this address is not a kinevox service");
  return json;
}

std::string FileSha256(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  const Digest digest = Sha256(in);
  if (!in.eof()) throw InputError("a file of the study cannot be read");
  return digest.Hex();
}

bool WorthAnotherTry(httplib::Error error, bool answered_before) {
  if (error == httplib::Error::Connection) return answered_before;
  return error != httplib::Error::SSLServerVerification &&
         error != httplib::Error::SSLServerHostnameVerification && error != httplib::Error::SSLConnection &&
         error != httplib::Error::SSLLoadingCerts;
}

// When to ask again where the service has no time (429), or a proxy finds no service behind it. Nothing where
// a quota is used up for longer than a minute: then it is the user's matter.
std::optional<std::chrono::seconds> BusyFor(const httplib::Response& response) {
  constexpr uint64_t kLongest = 60;
  const int status = response.status;
  if (status != 429 && status != 502 && status != 503 && status != 504) return std::nullopt;
  const uint64_t wanted = response.get_header_value_u64("Retry-After");
  if (status == 429 && wanted > kLongest) return std::nullopt;
  return std::chrono::seconds(std::min(wanted, kLongest));
}

std::string ReasonToWait(const httplib::Result& result) {
  if (!result) return "no kinevox service answers";
  const std::string detail = DetailIn(result->body);
  return detail.empty() ? StatusOnly(result->status) : detail.substr(0, detail.find(';'));
}

// What a client knows of its service, and whom it tells that it waits.
struct Contact {
  bool answered_before = false;
  WaitSink on_wait;

  // Pauses after this result; what is more than a moment is told. False: no more patience.
  bool Wait(Patience& patience, const httplib::Result& result) {
    const auto busy = result ? BusyFor(*result) : std::nullopt;
    const auto at_least = busy.value_or(std::chrono::seconds(0));
    if (on_wait && patience.Next(at_least) >= std::chrono::seconds(1)) on_wait(ReasonToWait(result));
    return patience.Pause(at_least);
  }
};

// Sends again while the service is busy, and when no answer came: what is sent has a key, or changes nothing.
// A service that has answered before may be starting again, and is waited for; where nobody listens at first,
// nobody does.
template <class Send>
httplib::Result SendPatiently(Contact& contact, const Send& send) {
  httplib::Result result = send();
  Patience patience;
  while (!InterruptRequested()) {
    contact.answered_before |= bool(result);
    const bool again =
        result ? BusyFor(*result).has_value() : WorthAnotherTry(result.error(), contact.answered_before);
    if (!again || !contact.Wait(patience, result)) return result;
    result = send();
  }
  if (!result || BusyFor(*result)) throw Cancelled();
  return result;
}

template <class Send>
ServiceJson SendKeyed(Contact& contact, const std::string& key, const Send& send) {
  const httplib::Headers headers{{"Idempotency-Key", key.empty() ? NewId("key") : key}};
  return Checked(SendPatiently(contact, [&] { return send(headers); }));
}

httplib::Headers TusHeaders() { return {{"Tus-Resumable", "1.0.0"}}; }

// Where an upload stands, and its whole; bytes.
struct Offset {
  size_t at, size;
};

// PATCH of the next bytes of the file. `progress`: the fraction of the whole that is on its way.
httplib::Result SendPart(httplib::Client& http, const std::string& address, std::ifstream& in, Offset offset,
                         const FractionSink& progress) {
  const auto provide = [&](size_t begin, size_t length, httplib::DataSink& sink) {
    const size_t from = offset.at + begin;
    std::string chunk(std::min<size_t>(length, 1 << 18), '\0');
    in.clear();
    in.seekg(std::streamoff(from));
    in.read(chunk.data(), std::streamsize(chunk.size()));
    progress(double(from) / double(offset.size));
    return in.gcount() > 0 && !InterruptRequested() && sink.write(chunk.data(), size_t(in.gcount()));
  };
  httplib::Headers headers = TusHeaders();
  headers.emplace("Upload-Offset", std::to_string(offset.at));
  const size_t part = std::min(kPartBytes, offset.size - offset.at);
  return http.Patch(address, headers, part, provide, "application/offset+octet-stream");
}

// False: the service is asked after a pause where the upload stands. Throws what pauses do not help against.
bool Taken(const httplib::Result& result) {
  if (!result) return false;
  const int status = result->status;
  if (status == 204) return true;
  const bool full = status == 507;  // not for minutes alone
  if (full || (!BusyFor(*result) && status < 500 && status != 409 && status != 423)) ThrowProblem(*result);
  return false;
}

// From the environment: an argument of a command is seen by everybody on the machine.
void UseToken(httplib::Client& http, const std::string& url) {
  if (const char* authority = std::getenv("KINEVOX_CA")) {
    RequireThere(authority);
    http.set_ca_cert_path(authority);
  }
  const char* token = std::getenv("KINEVOX_TOKEN");
  if (!token || !*token) return;
  if (url.starts_with("http://") && !IsLoopback(SplitUrl(url).host)) {
    throw UsageError("a token is not sent in the clear: use an https:// address");
  }
  http.set_bearer_token_auth(token);
}

}  // namespace

std::string UrlEncoded(const std::string& text) { return httplib::encode_uri_component(text); }

struct ServiceClient::State {
  explicit State(const std::string& url) : http(url) {}
  httplib::Client http;
  Contact contact;
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

void ServiceClient::OnWait(WaitSink sink) { state_->contact.on_wait = std::move(sink); }

ServiceJson ServiceClient::Get(const std::string& path) { return Checked(state_->http.Get(path)); }
ServiceJson ServiceClient::Delete(const std::string& path) { return Checked(state_->http.Delete(path)); }

ServiceJson ServiceClient::Post(const std::string& path, const ServiceJson& body, const std::string& key) {
  const std::string text =
      body.is_null() ? "" : body.dump(-1, ' ', false, ServiceJson::error_handler_t::replace);
  return SendKeyed(state_->contact, key, [&](const httplib::Headers& headers) {
    return state_->http.Post(path, headers, text, "application/json");
  });
}

ServiceJson ServiceClient::GetPatiently(const std::string& path) {
  return Checked(SendPatiently(state_->contact, [&] { return state_->http.Get(path); }));
}

std::string ServiceClient::CreateUpload(const FileToSend& file, const std::string& sha256, size_t size) {
  const char* kind = file.strokes ? "seeds" : file.bones ? "bones" : "scan";
  const std::string metadata = "subject " + Base64(file.subject) + ",filename " +
                               Base64("upload" + file.suffix) + ",sha256 " + Base64(sha256) + ",kind " +
                               Base64(kind) + "," + (file.bones ? "template " : "name ") + Base64(file.name);
  httplib::Headers headers = TusHeaders();
  headers.insert({{"Upload-Length", std::to_string(size)},
                  {"Upload-Metadata", metadata},
                  {"Idempotency-Key", NewId("key")}});
  const httplib::Result result = SendPatiently(state_->contact, [&] {
    return state_->http.Post("/v1/uploads", headers, "", "application/octet-stream");
  });
  if (!result) ThrowNoAnswer(result.error());
  if (result->status != 201) ThrowProblem(*result);
  return result->get_header_value("Location");
}

ServiceJson ServiceClient::SendParts(const std::string& address, const std::filesystem::path& file,
                                     const FractionSink& progress) {
  std::ifstream in(file, std::ios::binary);
  const size_t size = std::filesystem::file_size(file);
  size_t at = 0;
  Patience patience;
  while (true) {
    httplib::Result result = SendPart(state_->http, address, in, {at, size}, progress);
    if (InterruptRequested()) throw Cancelled();
    if (!Taken(result)) {
      if (!state_->contact.Wait(patience, result)) ThrowGivenUp(result);
      result = state_->http.Head(address, TusHeaders());
      if (!result || BusyFor(*result) || result->status >= 500) continue;
      if (result->status >= 400) ThrowProblem(*result);
    }
    if (result->has_header("Content-Location"))
      return GetPatiently(result->get_header_value("Content-Location"));
    const size_t reached = size_t(result->get_header_value_u64("Upload-Offset"));
    if (reached > at) patience = Patience();
    at = std::min(reached, size);
  }
}

ServiceJson ServiceClient::Upload(const FileToSend& file, const FractionSink& progress) {
  const std::string sha256 = FileSha256(file.file);
  const std::string path = "/v1/subjects/" + file.subject +
                           (file.bones ? "/bones?template=" : "/scans?name=") + UrlEncoded(file.name) +
                           "&filename=upload" + file.suffix + "&sha256=" + sha256;
  const size_t size = std::filesystem::file_size(file.file);
  Patience patience;
  while (true) {
    try {
      if (!file.strokes)
        return SendKeyed(state_->contact, "", [&](const httplib::Headers& headers) {
          return state_->http.Post(path, headers, "", "application/octet-stream");
        });
    } catch (const NotFound&) {  // the service does not have these bytes
    }
    try {
      return SendParts(CreateUpload(file, sha256, size), file.file, progress);
    } catch (const NotFound&) {  // the upload has gone, or the subject: the next round says which
      if (!patience.Pause()) throw;
    }
  }
}

namespace {

// What has come of a download. Kept over a broken connection;
// the rest is asked for while the ETag is the same.
struct Receiving {
  AtomicFile part;
  std::ofstream file;
  std::string etag, problem;
  uint64_t retry_after = 0;
  int status = 0;
  size_t received = 0, total = 0;

  explicit Receiving(const std::filesystem::path& out) : part(out) {
    Restart();
    if (!file) throw InputError("--out cannot be written; choose a place where you may write");
  }
  void Restart() {
    file.close();
    file.open(part.temporary(), std::ios::binary | std::ios::trunc);
    received = 0;
  }
  void Answered(const httplib::Response& response) {
    status = response.status;
    if (status != 206) Restart();
    etag = response.get_header_value("ETag");
    retry_after = response.get_header_value_u64("Retry-After");
    total = received + response.get_header_value_u64("Content-Length");
  }
  bool Take(const char* data, size_t size) {
    if (status >= 400) {
      problem.append(data, size);
      return true;
    }
    file.write(data, std::streamsize(size));
    received += size;
    return bool(file);
  }
};

httplib::Request RequestFor(const std::string& path, const std::string& post_body,
                            const Receiving& receiving) {
  httplib::Request request;
  request.method = post_body.empty() ? "GET" : "POST";
  request.path = path;
  request.body = post_body;
  request.set_header("Accept-Encoding", "identity");
  if (!post_body.empty()) {
    request.set_header("Content-Type", "application/json");
  } else if (receiving.received > 0 && !receiving.etag.empty()) {
    request.set_header("Range", "bytes=" + std::to_string(receiving.received) + "-");
    request.set_header("If-Range", receiving.etag);
  }
  return request;
}

}  // namespace

void ServiceClient::Download(const std::string& path, const std::string& post_body,
                             const std::filesystem::path& out, const FractionSink& progress) {
  Receiving receiving(out);
  Patience patience;
  while (true) {
    const size_t before = receiving.received;
    httplib::Request request = RequestFor(path, post_body, receiving);
    request.response_handler = [&](const httplib::Response& response) {
      return receiving.Answered(response), true;
    };
    request.content_receiver = [&](const char* data, size_t size, size_t, size_t) {
      const bool taken = receiving.Take(data, size);
      if (receiving.total > 0) progress(double(receiving.received) / double(receiving.total));
      return taken && !InterruptRequested();
    };
    const httplib::Result result = state_->http.send(request);
    if (InterruptRequested()) throw Cancelled();
    if (receiving.status >= 400) ThrowProblem(receiving.status, receiving.problem, receiving.retry_after);
    if (!receiving.file) throw Unavailable(kNotWritten);
    if (result && receiving.received == receiving.total) break;
    if (receiving.status == 0) ThrowNoAnswer(result.error());
    if (receiving.received > before) patience = Patience();
    if (!patience.Pause()) throw NoAnswer(kNoAnswer);
  }
  receiving.file.close();
  if (!receiving.file) throw Unavailable(kNotWritten);
  receiving.part.Commit();
}

}  // namespace kvx
