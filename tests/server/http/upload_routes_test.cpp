// tus over real sockets, PUT, long polls, forced cancels: what the handlers' tests cannot see.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>
#include <nlohmann/json.hpp>

#include "api/request.h"
#include "core/text/base64.h"
#include "server/http/http_server.h"
#include "server/http_library.h"
#include "server/jobs/workers.h"
#include "server/log.h"
#include "tests/support/service_world.h"

namespace kvx {
namespace {

using testing_support::ServiceWorld;

struct RunningServer {
  ServiceWorld world;
  Metrics metrics;
  HttpServer server;
  std::thread thread;
  httplib::Client http;
  std::string subject;

  RunningServer()
      : server(
            world.services, metrics, [] { return std::string(); }, Options()),
        thread([this] { server.Run(); }),
        http("127.0.0.1", server.port()) {
    subject = Json::parse(http.Post("/v1/subjects", R"({"region":"knee"})", "application/json")->body)["id"];
  }
  ~RunningServer() {
    server.Stop();
    thread.join();
  }
  static HttpOptions Options() {
    SetLogLevel("off");
    HttpOptions options;
    options.port = 0;
    return options;
  }
  std::string Metadata(const std::string& name) const {
    const auto coded = [](const std::string& text) { return Base64(text); };
    return "subject " + coded(subject) + ",name " + coded(name) + ",filename " + coded("a.nii");
  }
  httplib::Result Create(const std::string& name, const std::string& length) {
    return http.Post("/v1/uploads", httplib::Headers{{"Tus-Resumable", "1.0.0"},
                                                     {"Upload-Length", length},
                                                     {"Upload-Metadata", Metadata(name)}});
  }
  httplib::Result Patch(const std::string& at, const std::string& offset, const std::string& bytes) {
    return http.Patch(at, httplib::Headers{{"Tus-Resumable", "1.0.0"}, {"Upload-Offset", offset}}, bytes,
                      "application/offset+octet-stream");
  }
};

TEST(UploadRoutes, SpeakTus) {
  RunningServer s;
  const auto described = s.http.Options("/v1/uploads");
  EXPECT_EQ(described->status, 204);
  EXPECT_EQ(described->get_header_value("Tus-Version"), "1.0.0");
  EXPECT_NE(described->get_header_value("Tus-Extension").find("checksum"), std::string::npos);
  EXPECT_EQ(s.http.Post("/v1/uploads", httplib::Headers{{"Upload-Length", "3"}})->status, 412)
      << "no Tus-Resumable";
  const auto created = s.Create("pose00", "8");
  ASSERT_EQ(created->status, 201) << created->body;
  EXPECT_EQ(created->get_header_value("Tus-Resumable"), "1.0.0");
  EXPECT_TRUE(created->get_header_value("Upload-Expires").ends_with(" GMT"));
  const std::string at = created->get_header_value("Location");
  EXPECT_EQ(s.Patch(at, "0", "VOX")->get_header_value("Upload-Offset"), "3");
  EXPECT_EQ(s.Patch(at, "0", "VOX")->status, 409);
  EXPECT_EQ(
      s.http
          .Patch(at, httplib::Headers{{"Tus-Resumable", "1.0.0"}, {"Upload-Offset", "3"}}, "x", "text/plain")
          ->status,
      415);
  const auto head = s.http.Head(at, httplib::Headers{{"Tus-Resumable", "1.0.0"}});
  EXPECT_EQ(head->status, 200);
  EXPECT_EQ(head->get_header_value("Upload-Offset"), "3");
  EXPECT_EQ(head->get_header_value("Upload-Length"), "8");
  EXPECT_EQ(head->get_header_value("Cache-Control"), "no-store");
  const auto done = s.Patch(at, "3", "ELS12");
  EXPECT_EQ(done->status, 204);
  EXPECT_EQ(s.http.Get(done->get_header_value("Content-Location"))->status, 200);
  EXPECT_EQ(Json::parse(s.http.Get(at)->body)["state"], "finished");
  EXPECT_EQ(
      s.http.Head(at, httplib::Headers{{"Tus-Resumable", "1.0.0"}})->get_header_value("Content-Location"),
      done->get_header_value("Content-Location"));
}

// The record of a resumable upload is gone after some days.
TEST(UploadRoutes, TheAuditTrailSaysWhoseScanCame) {
  RunningServer s;
  const std::string at = s.Create("pose00", "8")->get_header_value("Location");
  const std::string scan = s.Patch(at, "0", "VOXELS12")->get_header_value("Content-Location");
  const auto entries = s.world.audit.List({}).items;
  ASSERT_GE(entries.size(), 2u);
  const std::string upload = at.substr(at.rfind('/') + 1), id = scan.substr(scan.rfind('/') + 1);
  EXPECT_TRUE(id.starts_with("scn_")) << scan;
  EXPECT_EQ(entries[0].entry.action, "PATCH /v1/uploads/:id");
  EXPECT_EQ(entries[0].entry.object, upload + " " + s.subject + " " + id);
  EXPECT_EQ(entries[1].entry.object, upload + " " + s.subject);
}

TEST(UploadRoutes, OneKeyMakesOneUpload) {
  RunningServer s;
  const auto create = [&](const char* length) {
    return s.http.Post("/v1/uploads", httplib::Headers{{"Tus-Resumable", "1.0.0"},
                                                       {"Upload-Length", length},
                                                       {"Upload-Metadata", s.Metadata("pose07")},
                                                       {"Idempotency-Key", "once"}});
  };
  const auto first = create("8"), again = create("8");
  ASSERT_EQ(first->status, 201) << first->body;
  EXPECT_EQ(again->status, 201);
  EXPECT_EQ(again->get_header_value("Location"), first->get_header_value("Location"));
  EXPECT_EQ(create("9")->status, 409) << "another request under the same key";
}

// The answer to the first did not come through, say.
TEST(UploadRoutes, ACreationWithBytesAgainUnderItsKeyTellsWhatCameOfThem) {
  RunningServer s;
  const auto create = [&](const char* name, const char* bytes) {
    return s.http.Post("/v1/uploads",
                       httplib::Headers{{"Tus-Resumable", "1.0.0"},
                                        {"Upload-Length", "8"},
                                        {"Upload-Metadata", s.Metadata(name)},
                                        {"Idempotency-Key", std::string("once-") + name}},
                       bytes, "application/offset+octet-stream");
  };
  for (const auto& [name, bytes, offset] :
       {std::tuple{"part", "VOX", "3"}, std::tuple{"whole", "VOXELS12", "8"}}) {
    const auto first = create(name, bytes), again = create(name, bytes);
    for (const auto* answer : {&first, &again}) {
      ASSERT_EQ((*answer)->status, 201) << (*answer)->body;
      EXPECT_EQ((*answer)->get_header_value("Upload-Offset"), offset);
      EXPECT_EQ((*answer)->get_header_value("Content-Location"), first->get_header_value("Content-Location"));
    }
    EXPECT_EQ(again->get_header_value("Location"), first->get_header_value("Location"));
  }
}

TEST(UploadRoutes, TerminateByDeleteOrBehindOldProxies) {
  RunningServer s;
  const std::string first = s.Create("a", "8")->get_header_value("Location");
  const std::string second = s.Create("b", "8")->get_header_value("Location");
  EXPECT_EQ(s.http.Delete(first, httplib::Headers{{"Tus-Resumable", "1.0.0"}})->status, 204);
  EXPECT_EQ(s.http.Head(first, httplib::Headers{{"Tus-Resumable", "1.0.0"}})->status, 404);
  const httplib::Headers hidden{{"Tus-Resumable", "1.0.0"}, {"X-HTTP-Method-Override", "DELETE"}};
  EXPECT_EQ(s.http.Post(second, hidden)->status, 204);
  EXPECT_EQ(s.http.Head(second, httplib::Headers{{"Tus-Resumable", "1.0.0"}})->status, 404);
}

TEST(UploadRoutes, TakeFilesByPut) {
  RunningServer s;
  const std::string at = "/v1/subjects/" + s.subject + "/scans/pose00?filename=a.nii";
  EXPECT_EQ(s.http.Put(at, "VOXELS1", "application/octet-stream")->status, 201);
  EXPECT_EQ(s.http.Put(at, "VOXELS1", "application/octet-stream")->status, 200);
  EXPECT_EQ(s.http.Put(at, "VOXELS2", "application/octet-stream")->status, 409);
  const std::string bones = "/v1/subjects/" + s.subject + "/bones/pose00";
  EXPECT_EQ(s.http.Put(bones, "VOXELSb", "application/octet-stream")->status, 201);
  EXPECT_EQ(s.http.Put(bones, "VOXELSb", "application/octet-stream")->status, 200);
}

TEST(UploadRoutes, TheSameBytesAgainMendWhatWasDamagedOnDisk) {
  RunningServer s;
  const std::string scans = "/v1/subjects/" + s.subject + "/scans";
  const Json scan =
      Json::parse(s.http.Put(scans + "/pose00?filename=a.nii", "VOXELS1", "application/octet-stream")->body);
  const std::string sha256 = scan["sha256"];
  const std::filesystem::path blob = s.world.blobs.PathOf(sha256);
  const auto damage = [&] { std::ofstream(blob) << "VOXELS2"; };
  damage();
  const std::string nothing = scans + "?name=pose01&filename=a.nii&sha256=" + sha256;
  EXPECT_EQ(s.http.Post(nothing)->status, 404) << "the bytes must be sent";
  EXPECT_EQ(s.http.Put(scans + "/pose00?filename=a.nii", "VOXELS1", "application/octet-stream")->status, 200);
  EXPECT_TRUE(IsIntact(blob));
  damage();
  EXPECT_EQ(s.http.Post(scans + "?name=pose01&filename=a.nii", "VOXELS1", "x/y")->status, 201);
  EXPECT_TRUE(IsIntact(blob));
  EXPECT_EQ(s.world.FilesUnder("incoming"), 0u);
}

TEST(UploadRoutes, WhatWasPutUnderANameIsThere) {
  RunningServer s;
  const std::string subject = "/v1/subjects/" + s.subject;
  const auto put = [&](const std::string& at, const char* bytes) {
    const auto made = s.http.Put(at, bytes, "application/octet-stream");
    EXPECT_EQ(made->status, 201) << made->body;
    return std::pair(made->body, made->get_header_value("Location"));
  };
  const auto expect_same = [&](const std::string& at, const std::pair<std::string, std::string>& made) {
    EXPECT_EQ(s.http.Get(at)->body, made.first) << at;
    EXPECT_EQ(s.http.Get(made.second)->body, made.first);
  };
  expect_same(subject + "/scans/pose00", put(subject + "/scans/pose00?filename=a.nii", "VOXELS1"));
  put(subject + "/bones/pose00", "VOXELSb");
  const std::string volume = subject + "/bones/pose00/volume";
  const auto before = s.http.Get(volume);
  EXPECT_EQ(before->body, "VOXELSb");
  const auto newest = put(subject + "/bones/pose00", "VOXELSc");
  expect_same(subject + "/bones/pose00", newest);
  EXPECT_EQ(s.http.Get(volume)->body, "VOXELSc");
  for (const std::string& at : {volume, newest.second + "/volume"})
    EXPECT_EQ(s.http.Get(at)->get_header_value("Cache-Control"), "private, no-cache") << at;
  for (const char* missing : {"/scans/pose01", "/bones/pose01", "/bones/pose01/volume"})
    EXPECT_EQ(s.http.Get(subject + missing)->status, 404) << missing;
}

TEST(JobRoutes, ALongPollAnswersWhenSomethingHappens) {
  RunningServer s;
  const std::string id = s.world.jobs.Submit({"build_model", "", "{}"}).id;
  const Json first = Json::parse(s.http.Get("/v1/jobs/" + id + "?after=0")->body);
  EXPECT_EQ(first["state"], "queued");
  EXPECT_EQ(first["queue_position"], 1);
  std::thread later([&] {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    s.world.jobs.Cancel(id);
  });
  const Json changed =
      Json::parse(s.http.Get("/v1/jobs/" + id + "?wait=60&after=" + first["event"].dump())->body);
  later.join();
  EXPECT_EQ(changed["state"], "cancelled");
  EXPECT_GT(changed["event"].get<int64_t>(), first["event"].get<int64_t>());
  EXPECT_EQ(s.http.Get("/v1/jobs/" + id + "?wait=61")->status, 400);
  EXPECT_EQ(s.http.Get("/v1/jobs/job_none?wait=60")->status, 404);
}

TEST(Workers, AJobThatDoesNotNoticeIsCancelledWithoutItsHelp) {
  ServiceWorld w;
  SetLogLevel("off");
  w.builder.deaf = true;
  w.builder.Hold();
  NewJob job{"build_model", "mdl", R"({"study":{},"files":[],"method":"adaptive"})"};
  const std::string id = w.jobs.Submit(job).id;
  {
    Workers workers(w.services, 1);
    while (w.builder.builds == 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    w.jobs.Cancel(id);
    while (!w.jobs.Require(id).Ended()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    EXPECT_EQ(w.jobs.Require(id).state, "cancelled") << "while the builder still holds on";
    w.builder.Open();
  }
  EXPECT_EQ(w.jobs.Require(id).state, "cancelled");
}

}  // namespace
}  // namespace kvx
