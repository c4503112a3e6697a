// Event streams and waits hold a thread each: they end with whom they are for.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>

#include "tests/support/raw_connection.h"
#include "tests/support/running_server.h"
#include "tests/support/signing.h"

namespace kvx {
namespace {

using testing_support::ExpectProblem;
using testing_support::RunningServer;
using testing_support::WithKeys;

struct StreamWorld : RunningServer {
  ApiKeys::Made key = world.keys.Add({"test", "lab", AccessScope::kRead, {}, std::nullopt});
  std::string id;  // of a job that waits
  std::string job;

  explicit StreamWorld(const HttpOptions& options) : RunningServer(options, false) {
    ProjectServices own(world.services, options.access.On() ? "lab" : "default");
    id = own.services.jobs.Submit({"build_model", "", "{}"}).id;
    job = "/v1/jobs/" + id;
  }
  httplib::Headers Token() const { return {{"Authorization", "Bearer " + key.text}}; }
  bool Soon(httplib::Client& client, int streams) {
    const std::string line = "kinevox_event_streams " + std::to_string(streams) + "\n";
    for (int i = 0; i < 200; ++i) {
      if (client.Get("/metrics", Token())->body.find(line) != std::string::npos) return true;
      std::this_thread::sleep_for(std::chrono::milliseconds(50));
    }
    return false;
  }
  void RevokeAndCancel() {
    world.keys.Revoke(key.record.id);
    world.services.jobs.Cancel(id);
  }
};

// A page that is reloaded begins a wait each time, and does not end the one before.
TEST(EventStreams, AWaitWhoseClientHasGoneLeavesItsPlace) {
  StreamWorld s({.event_streams = 1});
  {
    const testing_support::RawConnection left(s.server.port());
    left.Send("GET " + s.job + "?wait=60 HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n");
    ASSERT_TRUE(s.Soon(s.http, 1));
  }
  EXPECT_TRUE(s.Soon(s.http, 0));
  EXPECT_EQ(s.http.Get(s.job + "?wait=1")->status, 200);
}

TEST(EventStreams, SoDoesOneOverTls) {
  const testing_support::ScratchFolder scratch;
  const testing_support::SelfSigned certificate(scratch.path());
  HttpOptions options = WithKeys();
  options.tls_certificate = certificate.certificate_file();
  options.tls_key = certificate.key_file();
  StreamWorld s(options);
  httplib::Client https("https://127.0.0.1:" + std::to_string(s.server.port()));
  https.enable_server_certificate_verification(false);
  {
    httplib::Client left("https://127.0.0.1:" + std::to_string(s.server.port()));
    left.enable_server_certificate_verification(false);
    left.set_read_timeout(std::chrono::seconds(1));
    EXPECT_FALSE(left.Get(s.job + "?wait=60", s.Token()));
  }
  EXPECT_TRUE(s.Soon(https, 0));
}

TEST(EventStreams, ARevokedKeySeesNoMoreEvents) {
  StreamWorld s(WithKeys());
  std::string seen;
  s.http.Get(s.job + "/events", s.Token(), [&](const char* data, size_t size) {
    if (seen.find("queued") == seen.npos && std::string(data, size).find("queued") != seen.npos)
      s.RevokeAndCancel();
    seen.append(data, size);
    return true;
  });
  EXPECT_THAT(seen, testing::HasSubstr("queued"));
  EXPECT_THAT(seen, testing::Not(testing::HasSubstr("cancelled")));
}

TEST(EventStreams, NorTheEndOfItsWait) {
  StreamWorld s(WithKeys());
  httplib::Client another("127.0.0.1", s.server.port());
  auto wait = std::async(std::launch::async, [&] { return another.Get(s.job + "?wait=60", s.Token()); });
  EXPECT_TRUE(s.Soon(s.http, 1));
  s.RevokeAndCancel();
  ExpectProblem(wait.get(), 401);
}

}  // namespace
}  // namespace kvx
