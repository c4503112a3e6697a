// Every POST carries an Idempotency-Key, so one that lost its answer can be sent again.
#include "cli/service/service_client.h"

#include <netinet/tcp.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>

#include "cli/commands.h"
#include "cli/options/named_files.h"
#include "cli/service/asked_jobs.h"
#include "cli/service/patience.h"
#include "cli/service/service_contact.h"
#include "core/digest.h"
#include "core/text/base64.h"
#include "server/address.h"
#include "storage/ids.h"

namespace kvx {
namespace {

constexpr size_t kPartBytes = size_t(32) << 20;

std::string FileSha256(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  const Digest digest = Sha256(in);
  if (!in.eof()) throw InputError("a file of the study cannot be read");
  return digest.Hex();
}

std::string MetadataOf(const FileToSend& file, const std::string& sha256) {
  const char* kind = file.strokes ? "seeds" : file.bones ? "bones" : "scan";
  return "subject " + Base64(file.subject) + ",filename " + Base64("upload" + file.suffix) + ",sha256 " +
         Base64(sha256) + ",kind " + Base64(kind) + "," + (file.bones ? "template " : "name ") +
         Base64(file.name);
}

// Of a job, or of any of a batch.
bool HasCancelled(const ServiceJson& now) {
  return now.value("state", "") == "cancelled" || now.value("/counts/cancelled"_json_pointer, 0) > 0;
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

// Without what surrounds it in a file that it was read from. Empty: there is none.
std::string TokenOfEnvironment() {
  const char* given = std::getenv("KINEVOX_TOKEN");
  const std::string text = given ? given : "";
  constexpr char kAround[] = " \t\r\n";
  const size_t first = text.find_first_not_of(kAround);
  if (first == text.npos) return "";
  const std::string token = text.substr(first, text.find_last_not_of(kAround) + 1 - first);
  if (std::ranges::any_of(token, [](char c) { return c <= ' ' || c > '~'; }))
    throw UsageError(
        "the variable KINEVOX_TOKEN holds a blank, a line end or another character that no key has");
  return token;
}

// From the environment: an argument of a command is seen by everybody on the machine.
void UseToken(httplib::Client& http, const std::string& url) {
  if (const char* authority = std::getenv("KINEVOX_CA")) {
    RequireThere(authority);
    http.set_ca_cert_path(authority);
  }
  const std::string token = TokenOfEnvironment();
  if (token.empty()) return;
  if (url.starts_with("http://") && !IsLoopback(SplitUrl(url).host)) {
    throw UsageError("a token is not sent in the clear: use an https:// address");
  }
  http.set_bearer_token_auth(token);
}

// A network that has gone ends no connection: whoever waits asks three times a minute whether the other end
// is there, and knows after a minute or so that it is not.
void NoticeADeadNetwork(socket_t connection) {
  const auto set = [connection](int level, int option, int value) {
    httplib::set_socket_opt(connection, level, option, value);
  };
  set(SOL_SOCKET, SO_KEEPALIVE, 1);
  set(IPPROTO_TCP, TCP_KEEPIDLE, 20);
  set(IPPROTO_TCP, TCP_KEEPINTVL, 10);
  set(IPPROTO_TCP, TCP_KEEPCNT, 3);
  set(IPPROTO_TCP, TCP_USER_TIMEOUT, 60'000);  // ms, of what was sent and is not acknowledged
}

}  // namespace

WaitSink TellOnStderr() {
  return [told = std::string()](const std::string& reason) mutable {
    if (reason == told) return;
    told = reason;
    std::fprintf(stderr, "kinevox: waiting: %s\n", reason.c_str());
  };
}

std::string UrlEncoded(const std::string& text) { return httplib::encode_uri_component(text); }

ServiceClient::ServiceClient(const std::string& url) {
  constexpr char kWanted[] = "--server takes an address like http://127.0.0.1:8080, without a path";
  if (!url.starts_with("http://") && !url.starts_with("https://")) throw UsageError(kWanted);
  const size_t path = url.find_first_of("/?#", url.find("://") + 3);
  if (path != url.npos && url.substr(path) != "/") throw UsageError(kWanted);
  state_ = std::make_unique<State>(url.substr(0, path));
  if (!state_->http.is_valid()) throw UsageError(kWanted);
  state_->http.set_connection_timeout(5);
  state_->http.set_read_timeout(600);  // a large upload is read whole before it is answered
  state_->http.set_write_timeout(60);
  state_->http.set_tcp_nodelay(true);
  state_->http.set_socket_options(NoticeADeadNetwork);
  UseToken(state_->http, url);
}

ServiceClient::~ServiceClient() = default;

void ServiceClient::OnWait(WaitSink sink) { state_->contact.on_wait = std::move(sink); }

ServiceJson ServiceClient::Post(const std::string& path, const ServiceJson& body, const std::string& key) {
  const std::string text =
      body.is_null() ? "" : body.dump(-1, ' ', false, ServiceJson::error_handler_t::replace);
  return Checked(state_->SendKeyed(key, [&](const httplib::Headers& headers) {
    return state_->http.Post(path, headers, text, "application/json");
  }));
}

ServiceJson ServiceClient::GetPatiently(const std::string& path) {
  return Checked(state_->SendPatiently([&] { return state_->http.Get(path); }));
}

std::string ServiceClient::WhyNotReady() {
  const httplib::Result result = UntilInterrupted(state_->http, [&] { return state_->http.Get("/readyz"); });
  return result && result->status == 503 ? ReasonToWait(result) : "";
}

ServiceJson ServiceClient::Delete(const std::string& path) {
  int tries = 0;
  const httplib::Result result = state_->SendPatiently([&] { return ++tries, state_->http.Delete(path); });
  if (tries == 1 || !result || result->status != 409) return Checked(result);
  ServiceJson now = GetPatiently(path);  // ended already: by the try before?
  return HasCancelled(now) ? now : Checked(result);
}

// An upload on the service: how much of it is there, and what it has become once all of it is.
struct ServiceClient::Standing {
  std::string address, record;
  size_t at = 0;  // bytes
};

// What came of the same bytes for the same place before is gone on with: `key` is theirs.
ServiceClient::Standing ServiceClient::CreateUpload(const std::string& metadata, size_t size,
                                                    const std::string& key) {
  httplib::Headers headers = TusHeaders();
  headers.insert(
      {{"Upload-Length", std::to_string(size)}, {"Upload-Metadata", metadata}, {"Idempotency-Key", key}});
  const httplib::Result result = state_->SendPatiently(
      [&] { return state_->http.Post("/v1/uploads", headers, "", "application/octet-stream"); });
  if (!result) ThrowNoAnswer(result.error());
  if (result->status == 410) throw NotFound("the upload has expired");
  if (result->status != 201) ThrowProblem(*result);
  return {result->get_header_value("Location"), result->get_header_value("Content-Location"),
          std::min(size_t(result->get_header_value_u64("Upload-Offset")), size)};
}

ServiceJson ServiceClient::SendParts(Standing upload, const std::filesystem::path& file,
                                     const FractionSink& progress) {
  std::ifstream in(file, std::ios::binary);
  const size_t size = std::filesystem::file_size(file);
  Patience patience;
  while (upload.record.empty()) {
    httplib::Client& http = state_->http;
    httplib::Result result = UntilInterrupted(http, [&] {
      return SendPart(http, upload.address, in, {upload.at, size}, progress);
    });
    ThrowIfInterrupted();
    if (!Taken(result)) {
      if (!state_->contact.Wait(patience, result)) ThrowGivenUp(result);
      result = UntilInterrupted(http, [&] { return http.Head(upload.address, TusHeaders()); });
      if (!result || BusyFor(*result) || result->status >= 500) continue;
      if (result->status >= 400) ThrowProblem(*result);
    }
    upload.record = result->get_header_value("Content-Location");
    const size_t reached = size_t(result->get_header_value_u64("Upload-Offset"));
    if (reached > upload.at) patience = Patience();
    upload.at = std::min(reached, size);
  }
  return GetPatiently(upload.record);
}

ServiceJson ServiceClient::SendResumably(const FileToSend& file, const std::string& sha256,
                                         const FractionSink& progress) {
  constexpr int kMostGone = 8;  // more are not looked for: a key of its own
  const std::string metadata = MetadataOf(file, sha256);
  const size_t size = std::filesystem::file_size(file.file);
  std::string key = NextKey("upload", Sha256(metadata).Hex());
  Patience patience;
  int gone = 0;
  while (true) {
    try {
      Standing upload = CreateUpload(metadata, size, key);
      const bool earlier = !upload.record.empty();
      ServiceJson record = SendParts(std::move(upload), file.file, progress);
      if (!earlier || !file.strokes || !EndedBadly(record["state"])) return record;
      key = NextKey(key, record["id"]);
    } catch (const NotFound&) {  // the upload has gone, or what it became, or the subject
      if (++gone > kMostGone && !patience.Pause()) throw;
      key = gone < kMostGone ? NextKey(key, "gone") : NewId("key");
    }
  }
}

// Without its bytes, which the service may have. What it has under the same name is no conflict.
ServiceJson ServiceClient::Announce(const FileToSend& file, const std::string& sha256) {
  constexpr char kNoBytes[] = "application/octet-stream";
  const std::string subject = "/v1/subjects/" + file.subject, name = UrlEncoded(file.name),
                    about = "filename=upload" + file.suffix + "&sha256=" + sha256;
  return Checked(state_->SendKeyed("", [&](const httplib::Headers& headers) {
    if (file.bones)
      return state_->http.Post(subject + "/bones?template=" + name + "&" + about, headers, "", kNoBytes);
    return state_->http.Put(subject + "/scans/" + name + "?" + about, headers, "", kNoBytes);
  }));
}

ServiceJson ServiceClient::Upload(const FileToSend& file, const FractionSink& progress) {
  const std::string sha256 = FileSha256(file.file);
  try {
    if (!file.strokes) return Announce(file, sha256);
  } catch (const NotFound&) {  // the service does not have these bytes
  }
  return SendResumably(file, sha256, progress);
}

}  // namespace kvx
