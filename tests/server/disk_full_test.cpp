// A service whose disk is nearly full keeps its reserve: nothing new comes, and what waits goes on later.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "api/handlers/resumable_uploads.h"
#include "tests/support/running_server.h"

namespace kvx {
namespace {

using testing_support::ExpectProblem;
using testing_support::RunningServer;
using testing_support::ServiceWorld;

void WaitUntil(const std::function<bool()>& happened) {
  while (!happened()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
}

TEST(DiskNearlyFull, NothingNewIsTaken) {
  RunningServer s({}, false);
  const Json model = s.Model();
  const std::string subject = s.Subject();
  s.world.services.has_room = [](int64_t) { return false; };
  const std::string scans = "/v1/subjects/" + subject + "/scans";
  const auto refused = s.http.Post(scans + "?name=pose09&filename=a.nii", "VOXELS", "x/y");
  ExpectProblem(refused, 507);
  EXPECT_EQ(refused->get_header_value("Retry-After"), "60");
  EXPECT_THAT(refused->body, testing::HasSubstr("disk is nearly full"));
  ExpectProblem(s.http.Put(scans + "/pose09?filename=a.nii", "VOXELS", "x/y"), 507);
  const Json another{{"subject", subject}, {"template", "pose00"}};
  ExpectProblem(s.http.Post("/v1/models", another.dump(), "application/json"), 507);
  EXPECT_EQ(s.http.Get(scans)->status, 200) << "what is there can be asked for";
  EXPECT_EQ(s.http.Delete("/v1/jobs/" + std::string(model["job"]))->status, 202);
  EXPECT_EQ(s.http.Delete("/v1/subjects/" + subject)->status, 204) << "removing makes room";
}

// Resumable uploads alone take a method from a header.
TEST(DiskNearlyFull, AHeaderThatNamesAnotherMethodMakesNoRoom) {
  RunningServer s({}, false);
  const std::string subject = s.Subject();
  const std::string upload = CreateResumableUpload(s.world.services, "9",
                                                   "subject " + Base64(subject) + ",name " + Base64("b") +
                                                       ",filename " + Base64("b.nii"))
                                 .id;
  s.world.services.has_room = [](int64_t) { return false; };
  for (const char* method : {"DELETE", "GET", "HEAD"}) {
    const httplib::Headers header{{"X-HTTP-Method-Override", method}};
    ExpectProblem(s.http.Post("/v1/subjects", header, R"({"region":"knee"})", "application/json"), 507);
    ExpectProblem(
        s.http.Post("/v1/subjects/" + subject + "/scans?name=c&filename=c.nii", header, "VOXELS", "x/y"),
        507);
  }
  const httplib::Headers remove{{"X-HTTP-Method-Override", "DELETE"}, {"Tus-Resumable", "1.0.0"}};
  EXPECT_EQ(s.http.Post("/v1/uploads/" + upload, remove)->status, 204) << "removing makes room";
}

TEST(DiskNearlyFull, AnUploadCountsBeforeItComes) {
  RunningServer s({}, false);
  const std::string scans = "/v1/subjects/" + s.Subject() + "/scans?filename=a.nii&name=";
  s.world.services.has_room = [](int64_t more) { return more <= 10; };
  EXPECT_EQ(s.http.Post(scans + "small", "VOXELS", "x/y")->status, 201);
  ExpectProblem(s.http.Post(scans + "large", "VOXELS and more", "x/y"), 507);
}

// Nobody says how many bytes come in chunks: what was let in is looked at again.
TEST(DiskNearlyFull, AnUploadIsLookedAtAgainWhileItComes) {
  ServiceWorld w;
  w.services.upload_quota_bytes = int64_t(1) << 30;
  const std::string subject = w.catalogue.AddSubject({std::nullopt, "knee", std::nullopt}).id;
  const std::string mebibyte(1 << 20, 'V');
  const auto send = [&](auto& upload) {
    for (int i = 0; i < 63; ++i) upload.Write(mebibyte);
    EXPECT_THROW(upload.Write(mebibyte), DiskNearlyFull);
  };
  const std::string resumable = CreateResumableUpload(w.services, std::to_string(100 << 20),
                                                      "subject " + Base64(subject) + ",name " + Base64("b") +
                                                          ",filename " + Base64("b.nii"))
                                    .id;
  w.services.has_room = [](int64_t) { return false; };
  {
    Upload plain = Upload::OfScan(w.services, subject, {{"name", "a"}, {"filename", "a.nii"}}, "");
    send(plain);
  }
  ResumablePart part(w.services, resumable, "0", "");
  send(part);
  EXPECT_EQ(w.FilesUnder("incoming"), 0u) << "what was refused leaves nothing";
}

TEST(DiskNearlyFull, JobsWaitUntilThereIsRoom) {
  ServiceWorld w;
  SetLogLevel("off");
  std::atomic<int> asked = 0;
  std::atomic<bool> room = false;
  w.services.has_room = [&](int64_t) { return ++asked, room.load(); };
  const std::string id =
      w.jobs.Submit({"build_model", "mdl", R"({"study":{},"files":[],"method":"adaptive"})"}).id;
  Workers workers(w.services, 1);
  WaitUntil([&] { return asked >= 2; });
  EXPECT_EQ(w.jobs.Require(id).state, "queued");
  EXPECT_EQ(w.builder.builds, 0);
  room = true;
  WaitUntil([&] { return w.jobs.Require(id).Ended(); });
  EXPECT_EQ(w.builder.builds, 1);
}

// With a reserve of 0 a full disk has "room" for nothing.
TEST(DiskNearlyFull, WithoutAReserveAFullDiskBeginsNoJobEither) {
  ServiceWorld w;
  w.services.has_room = [](int64_t more) { return more <= 0; };
  EXPECT_THAT(FullDisk(w.services), testing::HasSubstr("nearly full"));
  w.services.has_room = [](int64_t more) { return more <= int64_t(1) << 30; };
  EXPECT_EQ(FullDisk(w.services), "");
}

TEST(DiskNearlyFull, JobsWaitUntilTheDeviceCanKeepWhatItCompiles) {
  ServiceWorld w;
  std::atomic<int> asked = 0;
  w.services.has_room = [&](int64_t) { return ++asked > 0; };
  w.poser.device_has_room = false;
  const std::string id =
      w.jobs.Submit({"build_model", "mdl", R"({"study":{},"files":[],"method":"adaptive"})"}).id;
  SetLogLevel("error");
  testing::internal::CaptureStderr();
  Workers workers(w.services, 1);
  WaitUntil([&] { return asked >= 2; });
  EXPECT_EQ(w.jobs.Require(id).state, "queued");
  w.poser.device_has_room = true;
  WaitUntil([&] { return w.jobs.Require(id).Ended(); });
  SetLogLevel("off");
  EXPECT_THAT(testing::internal::GetCapturedStderr(), testing::HasSubstr("PoCL's folder"));
  EXPECT_EQ(w.builder.builds, 1);
}

TEST(DiskNearlyFull, WhatGoesWrongAtEveryLookIsLoggedOnce) {
  ServiceWorld w;
  std::atomic<int> asked = 0;
  w.services.has_room = [&](int64_t) -> bool { throw Unavailable("look " + std::to_string(++asked)); };
  SetLogLevel("error");
  testing::internal::CaptureStderr();
  {
    Workers workers(w.services, 1);
    WaitUntil([&] { return asked >= 3; });
  }
  SetLogLevel("off");
  const std::string log = testing::internal::GetCapturedStderr();
  EXPECT_EQ(std::ranges::count(log, '\n'), 1) << log;
  EXPECT_THAT(log, testing::HasSubstr("look 1"));
}

}  // namespace
}  // namespace kvx
