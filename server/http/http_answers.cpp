// From handlers' answers to the wire.
#include <chrono>
#include <limits>
#include <nlohmann/json.hpp>

#include "api/handlers/jobs.h"
#include "server/http/http_context.h"
#include "server/http/known_paths.h"
#include "storage/ids.h"

namespace kvx {
namespace {

constexpr int kLongestWaitSeconds = 60;
constexpr size_t kFileChunk = 256 * 1024;
constexpr char kSizeKey[] = "size";  // of the file that is sent
// No address says all that its file depends on: an upgrade of the program may pose differently.
constexpr char kAskEachTime[] = "private, no-cache";
using SteadyClock = std::chrono::steady_clock;

// One of the few event streams, from its first byte until the client or the service ends it.
struct EventStream {
  HttpContext& context;
  ProjectShares::Place place;
  std::string authorization, job;
  int64_t last_event;
  SteadyClock::time_point opened = SteadyClock::now(), last_sent = SteadyClock::now();
  uint64_t seen_changes = 0;
  bool greeted = false;

  bool Step(httplib::DataSink& sink);
};

bool EventStream::Step(httplib::DataSink& sink) {
  if (!greeted) {
    greeted = true;
    if (!sink.os.write("retry: 2000\n\n", 13)) return false;
  }
  const EventBatch batch = NextEvents(context.services, job, last_event);
  last_event = batch.last;
  const bool quiet = SteadyClock::now() - last_sent > std::chrono::seconds(context.options.heartbeat_seconds);
  if (!batch.text.empty() || quiet) {
    context.access.Identify(authorization);  // a key may be revoked by now, a token be too old
    const std::string text = batch.text.empty() ? ": still here\n\n" : batch.text;
    if (!sink.write(text.data(), text.size())) return false;
    last_sent = SteadyClock::now();
  }
  const bool old = SteadyClock::now() - opened > std::chrono::seconds(context.options.stream_seconds);
  if (batch.ended || old || context.stopping) {
    sink.done();
    return true;
  }
  if (!sink.is_writable()) return false;
  seen_changes = context.services.jobs.WaitForChange(seen_changes, std::chrono::milliseconds(500));
  return true;
}

// A wait has a thread to itself, as an event stream does. An answer that does not wait would be asked for
// again at once, and again.
ProjectShares::Place TakeStream(HttpContext& context, httplib::Response& response) {
  auto place = context.streams.TryTake(IdentityOf(response).project);
  if (!place) {
    throw Unavailable(
        "too many event streams are open, or too many of your project; ask GET /v1/jobs/{job} without "
        "wait now and then instead");
  }
  return place;
}

// RFC 9110, 14.2: HEAD tells of the whole; 13.1.5: so does an answer that has changed since. The library
// picks the bytes by the request's ranges, and it owns the request as a mutable object.
void TakeRanges(const httplib::Request& request, const FileAnswer& answer) {
  const std::string if_range = request.get_header_value("If-Range");
  const bool changed = !if_range.empty() && if_range != answer.etag;
  if (request.method == "HEAD" || changed || !request.has_header("Range")) return;
  httplib::detail::parse_range_header(request.get_header_value("Range"),
                                      const_cast<httplib::Request&>(request).ranges);
}

int64_t LastEventId(const httplib::Request& request) {
  const std::string text = request.get_header_value("Last-Event-ID");
  if (text.empty()) return 0;
  const double id = ParseNumber(text, "Last-Event-ID");
  if (id < 0 || id > 9e15) throw InputError("Last-Event-ID is the id of an event");
  return int64_t(id);
}

}  // namespace

void SendJson(httplib::Response& response, int status, std::string body) {
  response.status = status;
  response.set_header("Cache-Control", "no-store");
  response.set_content(std::move(body), "application/json");
}

void SendAnswer(httplib::Response& response, const Answer& answer) {
  if (!answer.location.empty()) response.set_header("Location", answer.location);
  const Json json = Json::parse(answer.body, nullptr, false);  // an answer that was kept is text alone
  for (const char* about : {"subject", "id"}) {
    if (json.is_object() && json.contains(about) && json[about].is_string())
      NameObject(response, json[about].get<std::string>());
  }
  SendJson(response, answer.status, answer.body);
}

void SendProblem(httplib::Response& response, const Problem& problem) {
  std::string request_id = response.get_header_value("X-Request-Id");
  if (request_id.empty()) {
    request_id = NewId("req");
    response.set_header("X-Request-Id", request_id);
  }
  if (problem.status == 503) response.set_header("Retry-After", "2");
  if (problem.status == 507) response.set_header("Retry-After", "60");
  if (problem.status == 401) response.set_header("WWW-Authenticate", "Bearer realm=\"kinevox\"");
  response.status = problem.status;
  response.set_content(ProblemJson(problem, request_id), "application/problem+json");
}

void ForgetFile(httplib::Response& response) {
  for (const char* name : {"ETag", "Cache-Control", "Content-Disposition"}) response.headers.erase(name);
  std::erase_if(response.headers, [](const auto& header) { return header.first.starts_with("X-Kinevox-"); });
  if (const size_t* size = response.user_data.get<size_t>(kSizeKey))
    response.set_header("Content-Range", "bytes */" + std::to_string(*size));
}

void AnswerWrongMethod(const httplib::Request& request, httplib::Response& response) {
  // Of a method that the library does not know it has not read the path
  const std::string target = request.target.substr(0, request.target.find('?'));
  const std::string allowed = MethodsAt(request.path.empty() ? target : request.path);
  if (allowed.empty()) return;
  response.set_header("Allow", allowed);
  SendProblem(response, {405, "method", "Method not allowed", "this address takes " + allowed});
}

void SendFile(const httplib::Request& request, httplib::Response& response, const FileAnswer& answer) {
  response.set_header("ETag", answer.etag);
  response.set_header("Cache-Control", kAskEachTime);
  for (const auto& [name, value] : answer.headers) response.set_header(name, value);
  if (answer.not_modified) {
    response.status = 304;
    return;
  }
  response.user_data.set(kSizeKey, answer.file->size() - answer.offset);
  response.set_header("Accept-Ranges", "bytes");
  const bool shown = answer.content_type.starts_with("image/");  // a browser can
  response.set_header("Content-Disposition",
                      (shown ? "inline; filename=\"" : "attachment; filename=\"") + answer.filename + "\"");
  TakeRanges(request, answer);
  response.set_content_provider(
      answer.file->size() - answer.offset, answer.content_type,
      [file = answer.file, begin = answer.offset](size_t offset, size_t length, httplib::DataSink& sink) {
        try {
          std::string chunk(std::min(length, kFileChunk), '\0');
          chunk.resize(file->ReadAt(begin + offset, chunk.data(), chunk.size()));
          return !chunk.empty() && sink.write(chunk.data(), chunk.size());
        } catch (const std::exception&) {
          return false;  // the connection breaks off: the client sees a short body
        }
      });
}

std::string WaitForJob(const httplib::Request& request, httplib::Response& response, HttpContext& context) {
  Services& services = ServicesOf(response);
  const Query query = QueryOf(request);
  RequireKnown(query, {"wait", "after"});
  const std::string& id = request.path_params.at("id");
  const int seconds = QueryInt(query, "wait", 0, 0, kLongestWaitSeconds);
  if (seconds == 0 && QueryValue(query, "after").empty()) return GetJob(services, id);
  JobLook look = LookAtJob(services, id, 0);
  const int64_t after = QueryInt(query, "after", int(look.last_event), 0, std::numeric_limits<int>::max());
  look = LookAtJob(services, id, after);
  if (look.changed || seconds == 0) return look.text;
  const auto place = TakeStream(context, response);
  const auto until = SteadyClock::now() + std::chrono::seconds(seconds);
  const auto goes_on = [&, gone = ConnectionWatch::ClientGone()] {
    return SteadyClock::now() < until && !context.stopping && !gone();
  };
  for (uint64_t seen = 0; !look.changed && goes_on();) {
    seen = context.services.jobs.WaitForChange(seen, std::chrono::milliseconds(300));
    look = LookAtJob(services, id, after);
  }
  context.access.Identify(request.get_header_value("Authorization"));  // by now it may count no more
  return look.text;
}

void SendJobEvents(const httplib::Request& request, httplib::Response& response, HttpContext& context,
                   const std::string& job) {
  const int64_t last_event = LastEventId(request);
  ServicesOf(response).jobs.Require(job);
  if (const EventBatch rest = NextEvents(ServicesOf(response), job, last_event);
      rest.ended && rest.text.empty()) {
    response.status = 204;  // an EventSource comes back after every other end
    return;
  }
  const auto stream = std::shared_ptr<EventStream>(new EventStream{
      context, TakeStream(context, response), request.get_header_value("Authorization"), job, last_event});
  response.set_header("Cache-Control", "no-store");
  response.set_header("X-Accel-Buffering", "no");
  response.status = 200;
  response.set_chunked_content_provider("text/event-stream", [stream](size_t, httplib::DataSink& sink) {
    try {
      return stream->Step(sink);
    } catch (const std::exception&) {
      return false;
    }
  });
}

}  // namespace kvx
