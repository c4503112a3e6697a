// The client against a real server whose answers are scripted: busy ones are waited out, others are not.
#include "cli/service/service_client.h"

#include <gtest/gtest.h>

#include <atomic>
#include <fstream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>
#include <thread>

#include "tests/support/fixtures.h"
#include "tests/support/listening_server.h"
#include "tests/support/running_server.h"

namespace kvx {
namespace {

using testing_support::ListeningServer;

// Answers with these states one after the other, then with 200 and {"tries": how many}.
class Scripted {
 public:
  explicit Scripted(std::vector<int> states, const std::string& retry_after = "0")
      : states_(std::move(states)) {
    const auto answer = [this, retry_after](const httplib::Request& request, httplib::Response& response) {
      keys_.insert(request.get_header_value("Idempotency-Key"));
      const size_t n = tries_++;
      response.status = n < states_.size() ? states_[n] : 200;
      response.set_header("Retry-After", retry_after);
      response.set_content(R"({"tries": )" + std::to_string(n + 1) + R"(, "detail": "said so"})",
                           "application/json");
    };
    server_.http.Get(".*", answer);
    server_.http.Post(".*", answer);
    server_.Listen();
  }
  std::string url() const { return server_.url(); }
  size_t tries() const { return tries_; }
  const std::set<std::string>& keys() const { return keys_; }

 private:
  std::vector<int> states_;
  std::atomic<size_t> tries_ = 0;
  std::set<std::string> keys_;
  ListeningServer server_;
};

TEST(ServiceClient, WaitsOutABusyService) {
  const Scripted service({429, 503, 502, 504});
  EXPECT_EQ(ServiceClient(service.url()).GetPatiently("/v1/jobs/a")["tries"], 5);
}

// Seconds until the system asks the other end of the connection from this port whether it is there; -1: it
// does not.
double SecondsToKeepalive(int port) {
  char local[8];
  std::snprintf(local, sizeof local, ":%04X", port);
  std::ifstream table("/proc/net/tcp");
  for (std::string line; std::getline(table, line);) {
    std::istringstream row(line);
    std::string number, from, to, state, queues, timer;
    row >> number >> from >> to >> state >> queues >> timer;
    if (from.ends_with(local) && timer.starts_with("02:"))
      return std::stoi(timer.substr(3), nullptr, 16) / 100.0;
  }
  return -1;
}

TEST(ServiceClient, NoticesThatTheNetworkHasGone) {
  double seconds = -1;
  ListeningServer server;
  server.http.Get("/v1/jobs", [&](const httplib::Request& request, httplib::Response& response) {
    for (int i = 0; i < 100 && seconds < 0; ++i) {  // until what it sent is acknowledged
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      seconds = SecondsToKeepalive(request.remote_port);
    }
    response.set_content("{}", "application/json");
  });
  server.Listen();
  ServiceClient(server.url()).GetPatiently("/v1/jobs");
  EXPECT_GT(seconds, 0);
  EXPECT_LE(seconds, 60);
}

TEST(ServiceClient, SendsAgainUnderTheSameKey) {
  const Scripted service({502, 429});
  EXPECT_EQ(ServiceClient(service.url()).Post("/v1/models", ServiceJson::object())["tries"], 3);
  EXPECT_EQ(service.keys().size(), 1u);
}

TEST(ServiceClient, ARefusalIsFinal) {
  const Scripted wrong({400, 200}), large({413}), gone({404});
  EXPECT_THROW(ServiceClient(wrong.url()).Post("/v1/models", ServiceJson::object()), InputError);
  EXPECT_EQ(wrong.tries(), 1u);
  EXPECT_THROW(ServiceClient(large.url()).Post("/v1/models", ServiceJson::object()), TooLarge);
  EXPECT_THROW(ServiceClient(gone.url()).GetPatiently("/v1/jobs/a"), NotFound);
}

// A quota of the day: no pause of minutes helps, and whoever waits must be told.
TEST(ServiceClient, SaysAtOnceThatAQuotaIsUsedUpForHours) {
  const Scripted service({429, 429}, "7300");
  try {
    ServiceClient(service.url()).Post("/v1/models", ServiceJson::object());
    ADD_FAILURE();
  } catch (const Refused& e) {
    EXPECT_STREQ(e.what(), "the service says: said so: in 3 h");
  }
  EXPECT_EQ(service.tries(), 1u);
}

TEST(ServiceClient, TellsWhyItWaits) {
  const Scripted service({502, 429}, "1");
  ServiceClient client(service.url());
  std::vector<std::string> reasons;
  client.OnWait([&](const std::string& reason) { reasons.push_back(reason); });
  EXPECT_EQ(client.GetPatiently("/v1/jobs/a")["tries"], 3);
  EXPECT_EQ(reasons, (std::vector<std::string>{"said so", "said so"}));
}

// A service that takes uploads, by tus alone, and answers their parts with these states, one after the other.
class TakesUploads {
 public:
  TakesUploads(std::vector<int> states, const std::string& retry_after) : states_(std::move(states)) {
    server_.http.Post("/v1/subjects/.*",
                      [](const httplib::Request&, httplib::Response& r) { r.status = 404; });
    server_.http.Post("/v1/uploads", [this](const httplib::Request& q, httplib::Response& r) {
      ++created;
      keys.insert(q.get_header_value("Idempotency-Key"));
      r.status = int(keys.size()) <= spent_keys ? 404 : 201;
      r.set_header("Location", "/v1/uploads/a");
      r.set_header("Upload-Offset", std::to_string(there));
      if (keys.size() == 1 && ended_before) r.set_header("Content-Location", "/v1/before");
    });
    server_.http.Patch("/v1/uploads/a", [this, retry_after](const httplib::Request& q, httplib::Response& r) {
      const size_t n = parts++;
      bytes = q.body;
      r.status = n < states_.size() ? states_[n] : 204;
      r.set_header("Retry-After", retry_after);
      if (r.status == 204)
        r.set_header("Content-Location", "/v1/scan");
      else
        r.set_content(R"({"detail": "used up; later"})", "application/problem+json");
    });
    server_.http.Get("/v1/uploads/a", [](const httplib::Request&, httplib::Response& r) {  // HEAD
      r.status = 200;
      r.set_header("Upload-Offset", "0");
    });
    server_.http.Get("/v1/before", [](const httplib::Request&, httplib::Response& r) {
      r.set_content(R"({"id": "job", "state": "cancelled"})", "application/json");
    });
    server_.http.Get("/v1/scan", [](const httplib::Request&, httplib::Response& r) {
      r.set_content(R"({"id": "scn"})", "application/json");
    });
    server_.Listen();
  }
  ServiceJson Send(const WaitSink& waits, bool strokes = false) const {
    const testing_support::ScratchFolder folder;
    std::ofstream(folder.path() / "a.nii") << "VOXELS";
    ServiceClient client(server_.url());
    client.OnWait(waits);
    return client.Upload({.subject = "sub",
                          .bones = strokes,
                          .strokes = strokes,
                          .name = "pose00",
                          .suffix = ".nii",
                          .file = folder.path() / "a.nii"},
                         [](double) {});
  }
  std::atomic<int> created = 0, parts = 0;
  std::set<std::string> keys;  // of creations
  int spent_keys = 0;          // the first ones lead to uploads that have gone
  bool ended_before = false;   // the upload of the first key
  size_t there = 0;            // of the upload, in bytes
  std::string bytes;           // of the last part

 private:
  std::vector<int> states_;
  ListeningServer server_;
};

TEST(ServiceClient, AnUploadGoesOnWhereAnEarlierCommandLeftIt) {
  TakesUploads service({507}, "0");
  EXPECT_THROW(service.Send({}), Unavailable);
  EXPECT_EQ(service.bytes, "VOXELS");
  service.there = 4;
  EXPECT_EQ(service.Send({})["id"], "scn");
  EXPECT_EQ(service.bytes, "LS");
  EXPECT_EQ(service.keys.size(), 1u) << "it is known by its key";
}

TEST(ServiceClient, StrokesWhoseJobOfThenIsSpentAreSentAnew) {
  TakesUploads service({}, "0");
  service.ended_before = true;
  EXPECT_EQ(service.Send({}, true)["id"], "scn");
  EXPECT_EQ(service.keys.size(), 2u);
}

TEST(ServiceClient, AnUploadThatHasGoneIsMadeAnew) {
  TakesUploads service({}, "0");
  service.spent_keys = 2;
  EXPECT_EQ(service.Send({})["id"], "scn");
  EXPECT_EQ(service.keys.size(), 3u);
  EXPECT_EQ(service.bytes, "VOXELS");
}

TEST(ServiceClient, AnUploadBeyondTheQuotaOfTheDayIsRefusedAtOnce) {
  const TakesUploads service({429}, "40000");
  EXPECT_THROW(service.Send({}), Refused);
  EXPECT_EQ(service.created, 1);
  EXPECT_EQ(service.parts, 1);
}

TEST(ServiceClient, AnUploadWaitsForItsNextMinuteAndSaysSo) {
  const TakesUploads service({429}, "1");
  std::vector<std::string> reasons;
  const auto tell = [&](const std::string& reason) { reasons.push_back(reason); };
  EXPECT_EQ(service.Send(tell)["id"], "scn");
  EXPECT_EQ(service.created, 1);
  EXPECT_EQ(service.parts, 2);
  EXPECT_EQ(reasons, std::vector<std::string>{"used up"});
}

// The answer to a first DELETE is lost behind a proxy; the second finds the job ended.
class EndedJob {
 public:
  EndedJob(int first, const std::string& now) {
    server_.http.Delete("/v1/jobs/a", [this, first](const httplib::Request&, httplib::Response& r) {
      r.status = tries_++ == 0 ? first : 409;
    });
    server_.http.Get("/v1/jobs/a", [now](const httplib::Request&, httplib::Response& r) {
      r.set_content(now, "application/json");
    });
    server_.Listen();
  }
  ServiceJson Cancel() const { return ServiceClient(server_.url()).Delete("/v1/jobs/a"); }

 private:
  std::atomic<int> tries_ = 0;
  ListeningServer server_;
};

TEST(ServiceClient, ACancellationWhoseAnswerWasLostCounts) {
  EXPECT_EQ(EndedJob(502, R"({"state": "cancelled"})").Cancel()["state"], "cancelled");
  EXPECT_EQ(EndedJob(502, R"({"counts": {"cancelled": 2}})").Cancel()["counts"]["cancelled"], 2);
  EXPECT_THROW(EndedJob(502, R"({"state": "succeeded"})").Cancel(), Conflict);
  EXPECT_THROW(EndedJob(409, R"({"state": "cancelled"})").Cancel(), Conflict) << "by somebody else";
}

// A second sender of the same scan, by a real service.
TEST(ServiceClient, WhatTheServiceHasUnderTheSameNameIsNoConflict) {
  testing_support::RunningServer s;
  const std::string subject = s.Post("/v1/subjects", {{"region", "knee"}})["id"];
  const testing_support::ScratchFolder folder;
  ServiceClient client("http://127.0.0.1:" + std::to_string(s.server.port()));
  const auto send = [&](const std::string& bytes) {
    std::ofstream(folder.path() / "a.nii") << bytes;
    FileToSend file{.subject = subject, .name = "pose00", .suffix = ".nii", .file = folder.path() / "a.nii"};
    return client.Upload(file, [](double) {})["id"];
  };
  const ServiceJson first = send("VOXELS0");
  EXPECT_EQ(send("VOXELS0"), first);
  EXPECT_THROW(send("VOXELS1"), Conflict);
}

TEST(ServiceClient, HandsOutWhatAnAnswerSaysOfItsPose) {
  ListeningServer server;
  server.http.Get("/posed", [](const httplib::Request&, httplib::Response& r) {
    r.set_header("X-Kinevox-Extrapolation", "4.70");
    r.set_header("X-Kinevox-Scan-Verdict", "mirrored");
    r.set_header("X-Kinevox-Size", "3,2,1");
    r.set_header("X-Kinevox-Type", "int16");
    r.set_content("VOXELS", "application/octet-stream");
  });
  server.Listen();
  const testing_support::ScratchFolder folder;
  const ToldOfPose told =
      ServiceClient(server.url()).Download("/posed", "", folder.path() / "a.raw", [](double) {});
  EXPECT_EQ(told.extrapolation, "4.70");
  EXPECT_EQ(told.scan_verdict, "mirrored");
  EXPECT_EQ(told.size, "3,2,1");
  EXPECT_EQ(told.type, "int16");
}

}  // namespace
}  // namespace kvx
