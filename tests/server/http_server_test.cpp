// The server over real sockets, with real storage and fake ports.
#include "server/http_server.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/running_server.h"

namespace kvx {
namespace {

using testing_support::ExpectProblem;
using testing_support::FakePoser;
using testing_support::RunningServer;
using testing_support::ServiceWorld;

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

TEST(HttpServer, AJobOfAKindThatNobodyKnowsFailsInWords) {
  RunningServer s;
  const Json job = s.WaitFor(s.world.jobs.Submit({"from_the_future", "", "{}"}).id);
  EXPECT_EQ(job["state"], "failed");
  EXPECT_NE(job["error"]["detail"].get<std::string>().find("jobs of this kind"), std::string::npos);
  EXPECT_TRUE(job["model"].is_null());
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
  if (answer) EXPECT_EQ(answer->status, 413);  // else the connection closed under what was being sent
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

TEST(HttpServer, PosedVolumesAreCachedConditionalAndRanged) {
  RunningServer s;
  const std::string path = "/v1/models/" + s.BuiltModel() + "/volume?tibia.flexion=35&format=nrrd";
  const auto whole = s.http.Get(path);
  ASSERT_EQ(whole->status, 200);
  EXPECT_EQ(whole->body, FakePoser::Content(35));
  const std::string etag = whole->get_header_value("ETag");
  EXPECT_TRUE(etag.starts_with('"'));
  EXPECT_EQ(whole->get_header_value("Cache-Control"), "private, no-cache")
      << "an upgrade may pose differently";
  const auto fresh = s.http.Get(path, httplib::Headers{{"If-None-Match", etag}});
  EXPECT_EQ(fresh->status, 304);
  EXPECT_TRUE(fresh->body.empty());
  EXPECT_EQ(fresh->get_header_value("ETag"), etag);
  const auto range = s.http.Get(path, httplib::Headers{{"Range", "bytes=100000-250009"}});
  EXPECT_EQ(range->status, 206);
  EXPECT_EQ(range->body, whole->body.substr(100000, 150010));
  EXPECT_EQ(range->get_header_value("Content-Range"),
            "bytes 100000-250009/" + std::to_string(whole->body.size()));
  const auto stale = s.http.Get(path, httplib::Headers{{"Range", "bytes=0-9"}, {"If-Range", "\"old\""}});
  EXPECT_EQ(stale->status, 200);
  EXPECT_EQ(stale->body.size(), whole->body.size());
  const auto head = s.http.Head(path);
  EXPECT_EQ(head->status, 200);
  EXPECT_EQ(head->get_header_value("Content-Length"), std::to_string(whole->body.size()));
  const auto beyond = s.http.Get(path, httplib::Headers{{"Range", "bytes=99999999-"}});
  ExpectProblem(beyond, 416);
  EXPECT_EQ(beyond->get_header_value("Content-Range"), "bytes */" + std::to_string(whole->body.size()));
  for (const char* name : {"ETag", "Content-Disposition", "Cache-Control"})
    EXPECT_FALSE(beyond->has_header(name)) << name << " is the file's, not the problem's";
  ExpectProblem(s.http.Get(path, httplib::Headers{{"If-Match", "\"old\""}}), 412);
  EXPECT_EQ(s.http.Get(path, httplib::Headers{{"If-Match", "\"old\", " + etag}})->status, 200);
  EXPECT_EQ(s.world.poser.volumes, 1);
  const auto posted = s.http.Post(path.substr(0, path.find('?')) + "?format=nrrd",
                                  R"({"joints":{"tibia.flexion":35}})", "application/json");
  EXPECT_EQ(posted->get_header_value("ETag"), etag);
}

TEST(HttpServer, CodingsAreNegotiatedAndNeverMixedWithRanges) {
  RunningServer s;
  const std::string path = "/v1/models/" + s.BuiltModel() + "/volume?format=nii";
  const auto plain = s.http.Get(path, httplib::Headers{{"Accept-Encoding", "identity"}});
  EXPECT_FALSE(plain->has_header("Content-Encoding"));
  EXPECT_EQ(plain->get_header_value("Vary"), "Accept-Encoding");
  s.http.set_decompress(false);
  const auto packed = s.http.Get(path, httplib::Headers{{"Accept-Encoding", "gzip"}});
  EXPECT_EQ(packed->get_header_value("Content-Encoding"), "gzip");
  EXPECT_EQ(packed->body.substr(0, 2), "\x1f\x8b");
  EXPECT_LT(packed->body.size(), plain->body.size() / 2);
  EXPECT_NE(packed->get_header_value("ETag"), plain->get_header_value("ETag"));
  const auto range =
      s.http.Get(path, httplib::Headers{{"Accept-Encoding", "gzip"}, {"Range", "bytes=10-19"}});
  EXPECT_EQ(range->status, 206);
  EXPECT_EQ(range->body, plain->body.substr(10, 10));
  const auto whole =
      s.http.Get(path.substr(0, path.size() - 3) + "nii.gz", httplib::Headers{{"Accept-Encoding", "gzip"}});
  EXPECT_FALSE(whole->has_header("Content-Encoding")) << "what is packed already is not packed again";
  EXPECT_EQ(s.http.Get(path + "&level=5")->status, 200);
  ExpectProblem(s.http.Get(path + "&level=6"), 400);
}

TEST(HttpServer, SlicesAndSurfacesAreServedAsVolumesAre) {
  RunningServer s;
  const std::string model = "/v1/models/" + s.BuiltModel();
  const auto slice = s.http.Get(model + "/slice?axis=sagittal&mm=3&tibia.flexion=20");
  EXPECT_EQ(slice->get_header_value("Content-Type"), "image/png");
  EXPECT_EQ(slice->body, "slice sagittal 3 20");
  EXPECT_EQ(s.http
                .Get(model + "/slice?axis=sagittal&mm=3&tibia.flexion=20",
                     httplib::Headers{{"If-None-Match", slice->get_header_value("ETag")}})
                ->status,
            304);
  EXPECT_EQ(s.http.Head(model + "/surface?bone=tibia")->get_header_value("Content-Type"),
            "model/gltf-binary");
  const auto stl =
      s.http.Post(model + "/surface?format=stl", R"({"joints":{"tibia.flexion":35}})", "application/json");
  EXPECT_EQ(stl->body.substr(0, 4), "STL ");
  ExpectProblem(s.http.Get(model + "/surface?bone=tail"), 404);
  ExpectProblem(s.http.Get(model + "/slice?format=jpg"), 400);
}

TEST(HttpServer, AnimationsAreJobsWithAFile) {
  RunningServer s;
  const std::string model = s.BuiltModel();
  const Json made =
      s.Post("/v1/models/" + model + "/animations?format=nii", {{"frames", Json::array({{{"time", 0}}})}});
  const Json job = s.WaitFor(made["job"]);
  ASSERT_EQ(job["state"], "succeeded") << job.dump();
  EXPECT_EQ(job["kind"], "animation");
  EXPECT_EQ(job["result"]["frames"], 3);
  const auto file = s.http.Get(job["result"]["content"].get<std::string>());
  EXPECT_EQ(file->body, "three frames as nii");
  EXPECT_TRUE(file->has_header("ETag"));
  ExpectProblem(s.http.Get("/v1/models/" + model + "/animations/job_none"), 404);
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

TEST(HttpServer, LabelMapsAreConvertedOneAtATime) {
  RunningServer s({}, false);
  const std::string path = "/v1/subjects/" + s.Subject() + "/bones/pose00/volume?format=nrrd";
  std::vector<std::thread> clients;
  std::atomic<int> served{0};
  for (int c = 0; c < 8; ++c) {
    clients.emplace_back([&] {
      httplib::Client http("127.0.0.1", s.server.port());
      const auto got = http.Get(path);
      served += got && got->status == 200;
    });
  }
  for (std::thread& client : clients) client.join();
  EXPECT_EQ(served, 8);
  EXPECT_EQ(s.world.builder.most_converting, 1);
}

TEST(HttpServer, RawVolumesSayTheirGeometry) {
  RunningServer s;
  const auto raw = s.http.Get("/v1/models/" + s.BuiltModel() + "/volume?format=raw");
  EXPECT_EQ(raw->body, "ab");
  EXPECT_EQ(raw->get_header_value("X-Kinevox-Size"), "2,1,1");
  EXPECT_EQ(raw->get_header_value("X-Kinevox-Type"), "uint8");
}

TEST(HttpServer, APoseOutsideTheExamplesIsTold) {
  RunningServer s;
  const std::string model = "/v1/models/" + s.BuiltModel();
  for (const std::string product : {"/volume?", "/field?", "/slice?", "/surface?"}) {
    const auto said = [&](const char* pose) {
      return s.http.Get(model + product + pose)->get_header_value("X-Kinevox-Extrapolation");
    };
    EXPECT_EQ(said("tibia.flexion=35"), "0.00") << product;
    EXPECT_EQ(said("tibia.flexion=100"), "1.00") << product;
  }
}

TEST(HttpServer, WhatIsPosedAsInAScanSaysWhetherThatBelongsToItsStudy) {
  RunningServer s;
  const std::string model = "/v1/models/" + s.BuiltModel();
  for (const std::string product : {"/volume?", "/field?", "/slice?", "/surface?", "/registration?"}) {
    const auto as_in = s.http.Get(model + product + "scan=pose01");
    EXPECT_EQ(as_in->get_header_value("X-Kinevox-Scan-Verdict"), "lost") << product;
    const httplib::Headers known{{"If-None-Match", as_in->get_header_value("ETag")}};
    EXPECT_EQ(s.http.Get(model + product + "scan=pose01", known)->get_header_value("X-Kinevox-Scan-Verdict"),
              "lost")
        << product;
  }
  EXPECT_FALSE(s.http.Get(model + "/volume?tibia.flexion=35")->has_header("X-Kinevox-Scan-Verdict"));
}

TEST(HttpServer, AFieldSaysItsGeometryAndItsErrors) {
  RunningServer s;
  const std::string path = "/v1/models/" + s.BuiltModel() + "/field?tibia.flexion=30";
  const auto field = s.http.Get(path);
  ASSERT_EQ(field->status, 200);
  EXPECT_EQ(field->body, std::string(24, '2'));  // level 2 when left out
  EXPECT_EQ(field->get_header_value("X-Kinevox-Size"), "2,1,1");
  EXPECT_EQ(field->get_header_value("X-Kinevox-Components"), "3");
  EXPECT_EQ(field->get_header_value("X-Kinevox-Type"), "float32");
  EXPECT_EQ(field->get_header_value("X-Kinevox-Largest-Error-Mm"), "2.5");
  EXPECT_EQ(s.http.Get(path, {{"If-None-Match", field->get_header_value("ETag")}})->status, 304);
  EXPECT_NE(s.http.Get(path + "&level=1")->get_header_value("ETag"), field->get_header_value("ETag"));
  EXPECT_EQ(s.http.Get(path + "&level=9")->status, 400);
}

TEST(HttpServer, ARegistrationIsOneFileForEachMapScanAndFormat) {
  RunningServer s;
  const std::string path = "/v1/models/" + s.BuiltModel() + "/registration?scan=pose01";
  const auto forward = s.http.Get(path);
  ASSERT_EQ(forward->status, 200);
  EXPECT_EQ(forward->body, "map 0 of pose01");
  EXPECT_EQ(forward->get_header_value("Content-Type"), "application/gzip");
  EXPECT_EQ(s.http.Get(path + "&map=template_from_scan&format=nrrd")->body, "map 1 of pose01");
  EXPECT_EQ(s.http.Get(path + "&map=confidence&format=mha")->body, "map 2 of pose01");
  EXPECT_EQ(s.http.Get(path + "&map=error&format=mha")->body, "map 3 of pose01");
  EXPECT_EQ(s.http.Get(path, {{"If-None-Match", forward->get_header_value("ETag")}})->status, 304);
  EXPECT_EQ(s.http.Get(path + "&map=certainty")->status, 400);
  EXPECT_EQ(s.http.Get(path + "&format=png")->status, 400);
  EXPECT_EQ(s.http.Get(path + "&level=1")->status, 400);
  EXPECT_EQ(s.http.Get("/v1/models/" + s.BuiltModel() + "/registration")->status, 400);
  EXPECT_EQ(s.http.Get("/v1/models/" + s.BuiltModel() + "/registration?scan=pose07")->status, 404);
}

TEST(Origins, APageMayReadEveryHeaderOfOurs) {
  HttpOptions options;
  options.cors_origins = {"https://viewer.example"};
  RunningServer s(options);
  const std::string model = "/v1/models/" + s.BuiltModel();
  for (const char* path : {"/volume?format=raw", "/field?tibia.flexion=30"}) {
    const auto answer = s.http.Get(model + path, {{"Origin", "https://viewer.example"}});
    ASSERT_EQ(answer->status, 200) << path;
    const std::string exposed = answer->get_header_value("Access-Control-Expose-Headers");
    for (const auto& [name, value] : answer->headers) {
      if (name.starts_with("X-Kinevox-")) EXPECT_THAT(exposed, testing::HasSubstr(name)) << path;
    }
  }
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

TEST(Workers, ARunningJobIsCancelled) {
  RunningServer s;
  s.world.builder.Hold();
  const std::string job = s.Model()["job"];
  EXPECT_EQ(s.http.Delete("/v1/jobs/" + job)->status, 202);
  EXPECT_EQ(s.WaitFor(job)["state"], "cancelled");
  ExpectProblem(s.http.Delete("/v1/jobs/" + job), 409);
}

TEST(Workers, StoppingGivesTheJobBackToTheQueue) {
  RunningServer s;
  s.world.builder.Hold();
  const std::string job = s.Model()["job"];
  for (int i = 0; i < 200 && s.world.builder.builds == 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  s.workers->Stop();
  const JobRecord record = s.world.jobs.Require(job);
  EXPECT_EQ(record.state, "queued");
  EXPECT_EQ(record.attempt, 0) << "an attempt that was stopped on request does not count";
}

TEST(Workers, PassingFailuresAreRetriedAndOthersNot) {
  RunningServer s({}, false);
  s.world.builder.fail_first = 1;
  const std::string job = s.Model()["job"];
  Workers workers(s.world.services, 1);
  for (int i = 0; i < 200 && s.world.jobs.Require(job).state != "queued"; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  for (int i = 0; i < 200 && s.world.builder.builds == 0; ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_EQ(s.world.builder.builds, 1);
  EXPECT_NE(s.world.jobs.Require(job).state, "failed");
}

TEST(JobWatch, CountsWhatAnyProcessDid) {
  RunningServer s({}, false);
  const std::string job = s.Model()["job"];
  const ClaimedJob claimed = *s.world.jobs.Claim("a worker of another process");
  s.world.jobs.Report(claimed, "bones", 0.1);
  s.world.now_ms += 2000;
  s.world.jobs.Report(claimed, "register pose01", 0.5);
  s.world.now_ms += 40'000;
  s.world.jobs.Succeed(claimed, "{}");
  const std::string text = s.http.Get("/metrics")->body;
  for (const char* line : {"kinevox_jobs_succeeded_total 1", "kinevox_stage_seconds_sum{stage=\"bones\"} 2\n",
                           "kinevox_stage_seconds_sum{stage=\"register\"} 40\n",
                           "kinevox_stage_seconds_count{stage=\"register\"} 1"}) {
    EXPECT_THAT(text, testing::HasSubstr(line));
  }
  EXPECT_THAT(s.http.Get("/metrics")->body, testing::HasSubstr("kinevox_jobs_succeeded_total 1\n"));
}

TEST(HttpServer, OperationsAnswer) {
  RunningServer s;
  EXPECT_EQ(s.http.Get("/healthz")->status, 200);
  EXPECT_EQ(s.http.Get("/readyz")->status, 200);
  EXPECT_THAT(s.http.Get("/docs")->body, testing::HasSubstr("width=device-width"))
      << "read on telephones too";
  EXPECT_THAT(s.http.Get("/metrics")->body, testing::HasSubstr("kinevox_jobs_queued 0"));
}

}  // namespace
}  // namespace kvx
