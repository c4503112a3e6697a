// Files from the service: what has come is kept over a broken connection and a busy service.
#include <fstream>

#include "cli/service/patience.h"
#include "cli/service/service_contact.h"
#include "cli/terminal/interrupt.h"
#include "pipeline/io/atomic_file.h"

namespace kvx {
namespace {

constexpr char kNotWritten[] = "the download cannot be written; is the disk full?";

ToldOfPose ToldBy(const httplib::Response& response) {
  const auto header = [&](const char* name) { return response.get_header_value(name); };
  return {header("X-Kinevox-Extrapolation"), header("X-Kinevox-Scan-Verdict"), header("X-Kinevox-Size"),
          header("X-Kinevox-Spacing"),       header("X-Kinevox-Origin"),       header("X-Kinevox-Direction"),
          header("X-Kinevox-Type")};
}

// What has come of a download; the rest is asked for while the ETag is the same.
struct Receiving {
  AtomicFile part;
  std::ofstream file;
  std::string etag, problem;
  int status = 0;
  size_t received = 0, total = 0;  // bytes; total 0: nobody has said
  ToldOfPose told;

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
    problem.clear();
    if (status >= 300) return;
    if (status != 206) Restart();
    etag = response.get_header_value("ETag");
    told = ToldBy(response);
    const uint64_t length = response.get_header_value_u64("Content-Length");
    total = length > 0 ? received + length : 0;
  }
  bool Take(const char* data, size_t size) {
    if (status >= 300) {
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
  if (!post_body.empty()) request.set_header("Content-Type", "application/json");
  if (receiving.received > 0 && !receiving.etag.empty()) {
    request.set_header("Range", "bytes=" + std::to_string(receiving.received) + "-");
    request.set_header("If-Range", receiving.etag);
  }
  return request;
}

// Asks for what has not come yet.
httplib::Result Receive(httplib::Client& http, httplib::Request request, Contact& contact,
                        Receiving& receiving, const FractionSink& progress) {
  request.response_handler = [&](const httplib::Response& response) {
    contact.answered_before = true;
    return receiving.Answered(response), true;
  };
  request.content_receiver = [&](const char* data, size_t size, size_t, size_t) {
    const bool taken = receiving.Take(data, size);
    if (receiving.total > 0) progress(double(receiving.received) / double(receiving.total));
    return taken && !InterruptRequested();
  };
  httplib::Result result = UntilInterrupted(http, [&] { return http.send(request); });
  ThrowIfInterrupted();
  if (!receiving.file) throw Unavailable(kNotWritten);
  if (result) result->body = receiving.problem;
  return result;
}

}  // namespace

ToldOfPose ServiceClient::Download(const std::string& path, const std::string& post_body,
                                   const std::filesystem::path& out, const FractionSink& progress) {
  Receiving receiving(out);
  Patience patience;
  while (true) {
    const size_t before = receiving.received;
    const httplib::Result result =
        Receive(state_->http, RequestFor(path, post_body, receiving), state_->contact, receiving, progress);
    if (result && result->status < 300) break;
    // All has come, but not that it was all: without a length only the end of the answer says so.
    const bool beyond_the_end = result && result->status == 416 && before > 0;
    if (beyond_the_end) receiving.Restart();
    if (receiving.received > before) patience = Patience();
    const bool again = beyond_the_end || state_->contact.WorthAnotherTry(result);
    if (!again || !state_->contact.Wait(patience, result)) ThrowGivenUp(result);
  }
  receiving.file.close();
  if (!receiving.file) throw Unavailable(kNotWritten);
  receiving.part.Commit();
  return receiving.told;
}

}  // namespace kvx
