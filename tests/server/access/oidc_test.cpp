// A provider that withdraws keys, is down, or answers a byte at a time.
#include "server/access/oidc.h"

#include <gtest/gtest.h>

#include <future>
#include <nlohmann/json.hpp>

#include "api/errors.h"
#include "core/errors.h"
#include "server/http_library.h"
#include "server/log.h"
#include "tests/support/fixtures.h"
#include "tests/support/signing.h"

namespace kvx {
namespace {

using nlohmann::json;
using testing_support::TokenSigner;

struct Provider {
  testing_support::ScratchFolder scratch;
  std::atomic<int64_t> now_ms{1'700'000'000'000};
  std::atomic<int64_t> set_ahead_ms{0};  // of the wall clock, by hand
  TokenSigner first{scratch.path() / "1", "k1"}, second{scratch.path() / "2", "k2"};
  httplib::Server http;
  std::mutex mutex;
  std::string published;
  std::atomic<bool> down{false}, dripping{false}, over{false};
  std::atomic<int> dripped{0};
  int port = 0;
  std::thread thread;

  Provider() {
    SetLogLevel("off");
    http.Get("/keys", [this](const httplib::Request&, httplib::Response& r) { Answer(r); });
    port = http.bind_to_any_port("127.0.0.1");
    thread = std::thread([this] { http.listen_after_bind(); });
    http.wait_until_ready();
  }
  ~Provider() {
    over = true;
    http.stop();
    thread.join();
  }
  void Answer(httplib::Response& r) {
    if (dripping) {
      r.set_chunked_content_provider("application/json", [this](size_t, httplib::DataSink& sink) {
        std::this_thread::sleep_for(std::chrono::milliseconds(100));
        ++dripped;
        return !over && sink.write(" ", 1);
      });
      return;
    }
    const std::lock_guard lock(mutex);
    if (down)
      r.status = 500;
    else
      r.set_content(published, "application/json");
  }
  void Publish(const TokenSigner& signer) {
    const std::lock_guard lock(mutex);
    published = "{\"keys\":[" + signer.public_key() + "]}";
  }
  std::unique_ptr<OidcVerifier> Verifier() {
    return std::make_unique<OidcVerifier>(
        OidcOptions{
            .issuer = "i", .audience = "a", .jwks = "http://127.0.0.1:" + std::to_string(port) + "/keys"},
        [this] { return now_ms + set_ahead_ms; }, [this] { return now_ms.load(); });
  }
  std::string Token(const TokenSigner& signer) const {
    return signer.Sign(json{{"iss", "i"},
                            {"aud", "a"},
                            {"sub", "u"},
                            {"exp", (now_ms + set_ahead_ms) / 1000 + 3600},
                            {"scope", {"kinevox.read"}},
                            {"kinevox_project", "lab"}});
  }
  // One that has heard of the first key and trusts it.
  std::unique_ptr<OidcVerifier> VerifierOfTheFirst() {
    auto verifier = Verifier();
    Publish(first);
    EXPECT_EQ(verifier->Verify(Token(first)).project, "lab");
    return verifier;
  }
};

TEST(OidcVerifier, AKeyThatTheProviderHasWithdrawnCountsNoLonger) {
  Provider p;
  const auto verifier = p.VerifierOfTheFirst();
  p.Publish(p.second);
  p.now_ms += 11 * 60'000;
  EXPECT_THROW(verifier->Verify(p.Token(p.first)), Unauthorised);
  EXPECT_EQ(verifier->Verify(p.Token(p.second)).project, "lab");
}

TEST(OidcVerifier, KeysGrowOldThoughTheClockIsSetBack) {
  Provider p;
  p.set_ahead_ms = 365 * kDayMs;
  const auto verifier = p.VerifierOfTheFirst();
  p.set_ahead_ms = 0;
  p.Publish(p.second);
  p.now_ms += 11 * 60'000;
  EXPECT_THROW(verifier->Verify(p.Token(p.first)), Unauthorised);
  EXPECT_EQ(verifier->Verify(p.Token(p.second)).project, "lab");
}

TEST(OidcVerifier, KeysOutliveTheirProviderByAnHour) {
  Provider p;
  const auto verifier = p.VerifierOfTheFirst();
  p.down = true;
  for (int minutes = 11; minutes < 60; minutes += 11) {
    p.now_ms += 11 * 60'000;
    EXPECT_EQ(verifier->Verify(p.Token(p.first)).project, "lab") << minutes;
  }
  p.now_ms += 11 * 60'000;
  EXPECT_THROW(verifier->Verify(p.Token(p.first)), Unavailable);
  p.down = false;
  p.now_ms += 31'000;
  EXPECT_EQ(verifier->Verify(p.Token(p.first)).project, "lab");
}

TEST(OidcVerifier, AProviderThatDripsHoldsUpNobodyWhoseKeyIsKnown) {
  Provider p;
  const auto verifier = p.VerifierOfTheFirst();
  p.now_ms += 31'000;
  p.dripping = true;
  auto unknown = std::async(std::launch::async, [&] { verifier->Verify(p.Token(p.second)); });
  while (p.dripped == 0) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  EXPECT_EQ(verifier->Verify(p.Token(p.first)).project, "lab");
  EXPECT_EQ(unknown.wait_for(std::chrono::seconds(0)), std::future_status::timeout) << "the keys still come";
  EXPECT_EQ(unknown.wait_for(std::chrono::seconds(60)), std::future_status::ready) << "it has its limit";
  p.over = true;
  EXPECT_THROW(unknown.get(), Unavailable);
}

}  // namespace
}  // namespace kvx
