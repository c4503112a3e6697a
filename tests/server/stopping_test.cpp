// A stop lets those that were let in finish, for a while; then it ends them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>

#include "tests/support/handler_requests.h"
#include "tests/support/raw_connection.h"
#include "tests/support/running_server.h"

namespace kvx {
namespace {

using testing_support::RawConnection;
using testing_support::RunningServer;
using testing_support::SendScan;

constexpr size_t kMoreThanSocketsHold = 32 << 20;

std::unique_ptr<RunningServer> ServerWithALargeScan(int drain_seconds) {
  HttpOptions options;
  options.drain_seconds = drain_seconds;
  auto s = std::make_unique<RunningServer>(options, false);
  s->world.services.upload_quota_bytes = int64_t(1) << 30;
  return s;
}

std::string LargeScan(RunningServer& s) {
  const std::string subject = s.Subject();
  SendScan(s.world, subject, "large", "VOXELS" + std::string(kMoreThanSocketsHold - 6, 'V'));
  return "/v1/subjects/" + subject + "/scans/large/volume";
}

double SecondsToStop(std::unique_ptr<RunningServer>& s) {
  const auto begin = std::chrono::steady_clock::now();
  s.reset();
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
}

TEST(Stopping, ADownloadUnderWayArrivesWholeAndNothingNewIsTaken) {
  auto s = ServerWithALargeScan(60);
  const std::string path = LargeScan(*s);
  httplib::Client client("127.0.0.1", s->server.port()), another("127.0.0.1", s->server.port());
  std::promise<void> begun;
  std::thread stopper([&] {
    begun.get_future().wait();
    s.reset();
  });
  size_t came = 0;
  int status_of_another = 0;
  const auto answer = client.Get(path, [&](const char*, size_t size) {
    if (came == 0) {
      begun.set_value();
      std::this_thread::sleep_for(std::chrono::milliseconds(500));
      if (const auto refused = another.Get("/v1/subjects")) status_of_another = refused->status;
    }
    came += size;
    return true;
  });
  if (came == 0) begun.set_value();
  stopper.join();
  EXPECT_EQ(came, kMoreThanSocketsHold);
  EXPECT_TRUE(answer);
  EXPECT_EQ(status_of_another, 503);
}

TEST(Stopping, WhoDoesNotReadIsEndedWithTheTimeForIt) {
  auto s = ServerWithALargeScan(1);
  const std::string path = LargeScan(*s);
  const RawConnection connection(s->server.port());
  connection.Send("GET " + path + " HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n");
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  const double seconds = SecondsToStop(s);
  EXPECT_GE(seconds, 1);
  EXPECT_LT(seconds, 10);
}

TEST(Stopping, ABodyThatComesNoFurtherIsEndedWithTheTimeForIt) {
  auto s = ServerWithALargeScan(1);
  const RawConnection connection(s->server.port());
  connection.Send("POST /v1/subjects HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 100\r\n\r\n{");
  std::this_thread::sleep_for(std::chrono::milliseconds(500));
  EXPECT_LT(SecondsToStop(s), 10);
}

TEST(Stopping, IsDoneAtOnceWhereNothingIsUnderWay) {
  auto s = ServerWithALargeScan(60);
  EXPECT_EQ(s->http.Get("/healthz")->status, 200);
  EXPECT_LT(SecondsToStop(s), 10);
}

}  // namespace
}  // namespace kvx
