// The server over real sockets, with real storage and fake ports.
#include "server/http/http_server.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <thread>

#include "core/version.h"
#include "tests/support/running_server.h"

namespace kvx {
namespace {

using testing_support::ExpectProblem;
using testing_support::RunningServer;

TEST(HttpServer, BuildsAModelFromUploads) {
  RunningServer s;
  const Json model = s.Model();
  const Json job = s.WaitFor(model["job"]);
  EXPECT_EQ(job["state"], "succeeded");
  EXPECT_EQ(job["progress"], 1.0);
  EXPECT_EQ(job["result"]["model"], model["id"]);
  EXPECT_EQ(job["result"]["warnings"][0], "scan b, bone tibia: doubtful");
  const Json info = Json::parse(s.http.Get("/v1/models/" + model["id"].get<std::string>())->body);
  EXPECT_EQ(info["id"], model["id"]);
  EXPECT_EQ(info["state"], "succeeded");
  EXPECT_EQ(info["version"], "x") << "the fields of kinevox info";
  EXPECT_EQ(info["digest"], job["result"]["digest"]);
}

TEST(HttpServer, FailuresAreProblemDocuments) {
  RunningServer s;
  ExpectProblem(s.http.Get("/v1/nowhere"), 404);
  ExpectProblem(s.http.Get("/v1/jobs/job_none"), 404);
  const auto wrong = s.http.Patch("/v1/subjects/sub_x", "{}", "application/json");
  ExpectProblem(wrong, 405);
  EXPECT_EQ(wrong->get_header_value("Allow"), "DELETE, GET, HEAD");
  ExpectProblem(s.http.Post("/v1/subjects", "{", "application/json"), 400);
  ExpectProblem(s.http.Get("/v1/subjects?cursor=zzz"), 400);
  ExpectProblem(
      s.http.Post("/v1/subjects", httplib::Headers{{"Content-Encoding", "gzip"}}, "{}", "application/json"),
      415);
  ExpectProblem(s.http.Get("/healthz", httplib::Headers{{"Host", "evil.example"}}), 421);
  ExpectProblem(s.http.Get("/healthz", httplib::Headers{{"Origin", "http://evil.example"}}), 403);
  ExpectProblem(s.http.Get("/v1/subjects", httplib::Headers{{"Sec-Fetch-Site", "cross-site"}}), 403);
  const std::string subject = s.Subject();
  ExpectProblem(
      s.http.Post("/v1/subjects/" + subject + "/scans?name=pose00&filename=a.nii", "VOXELS9", "x/y"), 409);
  ExpectProblem(s.http.Post("/v1/subjects/" + subject + "/scans?name=big&filename=a.nii",
                            std::string((1 << 20) + 1, 'V'), "x/y"),
                413);
  EXPECT_EQ(s.world.FilesUnder("incoming"), 0u);
}

TEST(HttpServer, ABodyThatIsTooLargeIsRefusedBeforeItComes) {
  RunningServer s;
  const std::string path = "/v1/subjects/" + s.Subject() + "/scans?name=big&filename=a.nii";
  httplib::Client raw("127.0.0.1", s.server.port());
  size_t sent = 0;
  const auto body = [&](size_t, size_t, httplib::DataSink& sink) {
    const std::string some(4096, 'V');
    sent += some.size();
    return sink.write(some.data(), some.size());
  };
  const auto answer = raw.Post(path, size_t(50) << 30, body, "application/octet-stream");
  EXPECT_LT(sent, size_t(8) << 20);
  if (answer) {  // else the connection closed under what was being sent
    EXPECT_EQ(answer->status, 413);
  }
  sent = 0;
  const auto asked = raw.Post(path, {{"Expect", "100-continue"}}, size_t(50) << 30, body, "x/y");
  ExpectProblem(asked, 413);
  EXPECT_THAT(asked->body, testing::HasSubstr("limits.upload_gib"));
  EXPECT_EQ(sent, 0u);
}

// Nobody reads it, so the library would keep it: a hundred such connections fill the memory.
TEST(HttpServer, ABodyThatNobodyReadsIsNotTaken) {
  RunningServer s;
  const std::string body(900 << 10, 'V');  // within what uploads may have
  const auto answered = [&](const std::string& method, const std::string& path) {
    httplib::Client raw("127.0.0.1", s.server.port());
    httplib::Request request;
    request.method = method, request.path = path, request.body = body;
    const auto result = raw.send(request);
    return result ? result->status : 0;  // 0: the connection closed under what was being sent
  };
  for (const auto& [method, path, status] :
       {std::tuple{"POST", "/nope", 404}, std::tuple{"GET", "/v1/subjects", 413},
        std::tuple{"DELETE", "/v1/jobs/job_x", 413}, std::tuple{"PUT", "/v1/jobs/job_x", 405}}) {
    const int got = answered(method, path);
    EXPECT_TRUE(got == status || got == 0) << method << " " << path << " " << got;
  }
  EXPECT_EQ(s.http.Delete("/v1/jobs/job_x", "{}", "application/json")->status, 404)
      << "a small one is let pass";
  EXPECT_EQ(s.http.Get("/healthz")->status, 200);
}

TEST(HttpServer, IdempotencyKeysAreHonoured) {
  RunningServer s;
  const httplib::Headers key{{"Idempotency-Key", "k1"}};
  const auto first = s.http.Post("/v1/subjects", key, R"({"region":"knee"})", "application/json");
  const auto again = s.http.Post("/v1/subjects", key, R"({"region":"knee"})", "application/json");
  EXPECT_EQ(again->body, first->body);
  EXPECT_EQ(again->get_header_value("Location"), first->get_header_value("Location"));
  ExpectProblem(s.http.Post("/v1/subjects", key, R"({"region":"hand"})", "application/json"), 409);
}

TEST(HttpServer, ListsArePagedByCursor) {
  RunningServer s({}, false);
  std::vector<std::string> made, seen;
  for (int i = 0; i < 5; ++i) made.push_back(s.Post("/v1/subjects", {{"region", "knee"}})["id"]);
  std::string path = "/v1/subjects?limit=2";
  for (int pages = 0; pages < 4; ++pages) {
    const Json page = Json::parse(s.http.Get(path)->body);
    for (const Json& item : page["items"]) seen.push_back(item["id"]);
    if (page["next"].is_null()) break;
    path = "/v1/subjects?limit=2&cursor=" + page["next"].get<std::string>();
  }
  EXPECT_EQ(seen, std::vector<std::string>(made.rbegin(), made.rend()));
}

TEST(HttpServer, MoreClientsThanThreadsAllGetTheirTurn) {
  HttpOptions options;
  options.threads = 2;
  RunningServer s(options);
  const std::string path = "/v1/models/" + s.BuiltModel() + "/slice?mm=";
  std::atomic<int> served{0};
  std::vector<std::thread> clients;
  for (int c = 0; c < 12; ++c) {
    clients.emplace_back([&, c] {
      httplib::Client http("127.0.0.1", s.server.port());
      http.set_keep_alive(true);
      for (int i = 0; i < 10; ++i) {
        const auto got = http.Get(path + std::to_string(c * 10 + i));
        served += got && got->status == 200;
      }
    });
  }
  for (std::thread& client : clients) client.join();
  EXPECT_EQ(served, 120);
}

TEST(HttpServer, EventsFollowAJobToItsEnd) {
  RunningServer s;
  s.world.builder.Hold();
  const Json model = s.Model();
  const std::string job = model["job"];
  std::thread opener([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(150));
    s.world.builder.Open();
  });
  const auto stream = s.http.Get("/v1/jobs/" + job + "/events");
  opener.join();
  EXPECT_EQ(stream->get_header_value("Content-Type"), "text/event-stream");
  EXPECT_THAT(stream->body, testing::HasSubstr(R"("state":"queued")"));
  EXPECT_THAT(stream->body, testing::HasSubstr(R"("stage":"stage2")"));
  EXPECT_THAT(stream->body, testing::HasSubstr(R"("state":"succeeded")"));
  const auto later = s.http.Get("/v1/jobs/" + job + "/events", httplib::Headers{{"Last-Event-ID", "1"}});
  EXPECT_THAT(later->body, testing::Not(testing::HasSubstr("id: 1\n")));
  EXPECT_THAT(later->body, testing::HasSubstr("id: 2\n"));
}

// A page's EventSource comes back after the end of every stream, until it is told that there is no more.
TEST(HttpServer, WhoHasSeenTheLastEventIsToldThatThereIsNoMore) {
  RunningServer s;
  const std::string job = s.Model()["job"];
  s.WaitFor(job);
  const auto after = [&](const std::string& event) {
    return s.http.Get("/v1/jobs/" + job + "/events", httplib::Headers{{"Last-Event-ID", event}});
  };
  const std::string seen = s.http.Get("/v1/jobs/" + job + "/events")->body;
  const size_t last = seen.rfind("id: ") + 4;
  const std::string last_event = seen.substr(last, seen.find('\n', last) - last);
  EXPECT_EQ(after(last_event)->status, 204);
  const auto one_more = after(std::to_string(std::stoi(last_event) - 1));
  EXPECT_EQ(one_more->status, 200);
  EXPECT_THAT(one_more->body, testing::HasSubstr("id: " + last_event + "\n"));
}

TEST(HttpServer, EventStreamsAreBounded) {
  RunningServer s({.event_streams = 0});
  ExpectProblem(s.http.Get("/v1/jobs/" + s.Model()["job"].get<std::string>() + "/events"), 503);
}

TEST(HttpServer, OperationsAnswer) {
  RunningServer s;
  EXPECT_EQ(s.http.Get("/healthz")->status, 200);
  EXPECT_EQ(s.http.Get("/readyz")->status, 200);
  EXPECT_THAT(s.http.Get("/docs")->body, testing::HasSubstr("width=device-width"))
      << "read on telephones too";
  const std::string figures = s.http.Get("/metrics")->body;
  EXPECT_THAT(figures, testing::HasSubstr("kinevox_jobs_queued 0"));
  const std::string version = ProgramVersion();
  EXPECT_THAT(figures, testing::HasSubstr("kinevox_build_info{version=\"" + version + "\"} 1\n"));
}

TEST(HttpServer, EveryAnswerHasSecurityHeadersAndATrace) {
  RunningServer s({}, false);
  const std::string trace = "4bf92f3577b34da6a3ce929d0e0e4736";
  const httplib::Headers caller{{"traceparent", "00-" + trace + "-00f067aa0ba902b7-01"}};
  for (const char* path : {"/healthz", "/v1/nowhere", "/v1/jobs"}) {
    const auto answer = s.http.Get(path, caller);
    for (const char* name :
         {"X-Content-Type-Options", "Content-Security-Policy", "X-Frame-Options", "Referrer-Policy"}) {
      EXPECT_EQ(answer->get_header_value_count(name), 1u) << path << " " << name;
    }
    EXPECT_THAT(answer->get_header_value("traceparent"), testing::StartsWith("00-" + trace + "-")) << path;
  }
  EXPECT_EQ(s.http.Get("/healthz", {{"traceparent", "nonsense"}})->get_header_value("traceparent").size(),
            55u);
}

}  // namespace
}  // namespace kvx
