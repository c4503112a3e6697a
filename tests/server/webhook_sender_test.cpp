// Signed as Standard Webhooks says, sent to a receiver on loopback, and never where it may not go.
#include "server/webhook_sender.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <nlohmann/json.hpp>
#include <system_error>

#include "core/errors.h"
#include "server/http_library.h"
#include "server/log.h"
#include "storage/job_queue.h"
#include "tests/support/fixtures.h"
#include "tests/support/scarce_memory.h"

namespace kvx {
namespace {

bool Public(const char* text) {
  sockaddr_in four{};
  four.sin_family = AF_INET;
  if (inet_pton(AF_INET, text, &four.sin_addr) == 1)
    return IsPublicAddress(reinterpret_cast<sockaddr&>(four));
  sockaddr_in6 six{};
  six.sin6_family = AF_INET6;
  EXPECT_EQ(inet_pton(AF_INET6, text, &six.sin6_addr), 1) << text;
  return IsPublicAddress(reinterpret_cast<sockaddr&>(six));
}

TEST(WebhookSender, KnowsPrivateAddresses) {
  for (const char* address : {"127.0.0.1",
                              "10.1.2.3",
                              "172.16.0.1",
                              "172.31.255.255",
                              "192.168.1.1",
                              "169.254.169.254",
                              "0.0.0.0",
                              "100.64.0.1",
                              "198.18.0.1",
                              "224.0.0.1",
                              "255.255.255.255",
                              "::1",
                              "::",
                              "fe80::1",
                              "fd00::1",
                              "::ffff:127.0.0.1",
                              "::ffff:10.0.0.1",
                              "ff02::1",
                              "2002:7f00:1::",
                              "2001:db8::1",
                              "64:ff9b::a00:1"}) {
    EXPECT_FALSE(Public(address)) << address;
  }
  for (const char* address :
       {"1.1.1.1", "172.15.0.1", "172.32.0.1", "100.128.0.1", "2606:4700::1111", "::ffff:1.1.1.1"}) {
    EXPECT_TRUE(Public(address)) << address;
  }
}

// The example of the Standard Webhooks specification's libraries.
TEST(WebhookSender, SignsAsTheStandardSays) {
  EXPECT_EQ(WebhookSignature("whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw", "msg_p5jXN8AQM9LWM0D4loKWxJek",
                             1614265330, R"({"test": 2432232314})"),
            "v1,g0hM9SsE+OTPJTGt/tmIKtSyZlE3uFJELVlNIOLJ1OE=");
}

TEST(WebhookSender, BacksOffAndGivesUp) {
  EXPECT_EQ(WebhookDelaySeconds(1), 5);
  for (int64_t failed = 2; failed <= 9; ++failed)
    EXPECT_GT(WebhookDelaySeconds(failed), WebhookDelaySeconds(failed - 1));
  EXPECT_EQ(WebhookDelaySeconds(10), 0);
}

// A receiver that refuses the first message it gets.
struct Receiver {
  httplib::Server http;
  std::mutex mutex;
  std::vector<httplib::Request> taken;
  int port = 0;
  std::thread thread;

  Receiver() {
    http.Post("/hook", [this](const httplib::Request& request, httplib::Response& response) {
      const std::lock_guard lock(mutex);
      taken.push_back(request);
      response.status = taken.size() == 1 ? 500 : 204;
    });
    port = http.bind_to_any_port("127.0.0.1");
    thread = std::thread([this] { http.listen_after_bind(); });
    http.wait_until_ready();
  }
  ~Receiver() {
    http.stop();
    thread.join();
  }
};

struct SenderWorld {
  testing_support::ScratchFolder scratch;
  std::atomic<int64_t> now_ms{1000};
  Database database{scratch.path() / "test.db", [this] { return now_ms.load(); }};
  JobQueue jobs{database};
  WebhookOutbox outbox{database};

  SenderWorld() { SetLogLevel("off"); }
  std::string Hook(int port) {
    return outbox
        .Add("http://127.0.0.1:" + std::to_string(port) + "/hook", "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw",
             R"(["job.cancelled"])")
        .id;
  }
  WebhookDelivery WaitFor(const std::string& hook, const std::function<bool(const WebhookDelivery&)>& done) {
    for (int i = 0; i < 1000; ++i) {
      const auto all = outbox.Deliveries(hook, 1);
      if (!all.empty() && done(all[0])) return all[0];
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    ADD_FAILURE() << "the message does not go";
    return {};
  }
};

TEST(WebhookSender, SendsUntilTaken) {
  SenderWorld w;
  Receiver receiver;
  const std::string hook = w.Hook(receiver.port);
  WebhookSender sender(w.outbox, {.allow_private_addresses = true});
  w.jobs.Cancel(w.jobs.Submit({"build_model", "mdl_x", "{}"}).id);
  const WebhookDelivery refused = w.WaitFor(hook, [](const auto& d) { return d.attempt == 1; });
  EXPECT_EQ(refused.answer, "answered with status 500");
  EXPECT_EQ(refused.next_ms, w.now_ms + 5000);
  w.now_ms += 5000;
  EXPECT_EQ(w.WaitFor(hook, [](const auto& d) { return d.state == "delivered"; }).attempt, 2);
  sender.Stop();
  const std::lock_guard lock(receiver.mutex);
  ASSERT_EQ(receiver.taken.size(), 2u);
  const httplib::Request& got = receiver.taken[1];
  EXPECT_EQ(got.get_header_value("webhook-id"), receiver.taken[0].get_header_value("webhook-id"));
  EXPECT_EQ(got.get_header_value("webhook-signature"),
            WebhookSignature("whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw", got.get_header_value("webhook-id"),
                             std::stoll(got.get_header_value("webhook-timestamp")), got.body));
  const auto body = nlohmann::json::parse(got.body);
  EXPECT_EQ(body["type"], "job.cancelled");
  EXPECT_EQ(body["data"]["model"], "mdl_x");
  EXPECT_EQ(body["timestamp"], "1970-01-01T00:00:01.000Z");
}

TEST(WebhookSender, ThatGetsTooFewThreadsIsRefusedWithoutAnEndOfTheProgram) {
  if (!KVX_MEMORY_CAN_BE_SCARCE) GTEST_SKIP();
  const auto begin = [] {
    SenderWorld w;
    testing_support::GetNoMoreMemoryThan(testing_support::kOneThread);
    try {
      WebhookSender sender(w.outbox, {});
    } catch (const std::system_error&) {
      std::_Exit(2);
    }
    std::_Exit(0);
  };
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(begin(), testing::ExitedWithCode(2), "");
}

// A redirect could lead anywhere: it is not followed, and nothing has been taken.
TEST(WebhookSender, ARedirectIsNoDelivery) {
  SenderWorld w;
  Receiver elsewhere;
  httplib::Server http;
  http.Post("/hook", [&](const httplib::Request&, httplib::Response& response) {
    response.set_redirect("http://127.0.0.1:" + std::to_string(elsewhere.port) + "/hook");
  });
  const int port = http.bind_to_any_port("127.0.0.1");
  std::thread serving([&] { http.listen_after_bind(); });
  http.wait_until_ready();
  const std::string hook = w.Hook(port);
  w.jobs.Cancel(w.jobs.Submit({"build_model", "mdl_x", "{}"}).id);
  {
    WebhookSender sender(w.outbox, {.allow_private_addresses = true});
    const WebhookDelivery tried = w.WaitFor(hook, [](const auto& d) { return d.attempt == 1; });
    EXPECT_EQ(tried.state, "waiting");
    EXPECT_EQ(tried.answer, "answered with status 302");
  }
  http.stop();
  serving.join();
  EXPECT_TRUE(elsewhere.taken.empty());
}

// One that answers a byte a second, for ever, holds up neither the others nor the end.
TEST(WebhookSender, ASlowReceiverHoldsNobodyUp) {
  SenderWorld w;
  Receiver good;
  httplib::Server slow;
  std::atomic<bool> over = false;
  slow.Post("/hook", [&](const httplib::Request&, httplib::Response& response) {
    response.set_chunked_content_provider("text/plain", [&](size_t, httplib::DataSink& sink) {
      std::this_thread::sleep_for(std::chrono::milliseconds(300));
      return !over && sink.write("x", 1);
    });
  });
  const int port = slow.bind_to_any_port("127.0.0.1");
  std::thread serving([&] { slow.listen_after_bind(); });
  slow.wait_until_ready();
  const std::string first = w.Hook(port), second = w.Hook(good.port);
  for (int i = 0; i < 3; ++i) w.jobs.Cancel(w.jobs.Submit({"build_model", "mdl_x", "{}"}).id);
  {
    WebhookSender sender(w.outbox, {.allow_private_addresses = true, .timeout_seconds = 1});
    EXPECT_EQ(w.WaitFor(first, [](const auto& d) { return d.attempt >= 1 || d.next_ms > 1000; }).state,
              "waiting");
    const auto done = [&] {
      const auto all = w.outbox.Deliveries(second, 10);
      return std::ranges::count_if(
                 all, [](const auto& d) { return d.state == "delivered" || d.attempt > 0; }) == 3;
    };
    const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
    while (!done() && std::chrono::steady_clock::now() < until)
      std::this_thread::sleep_for(std::chrono::milliseconds(20)), w.now_ms += 100;
    EXPECT_TRUE(done());
  }
  over = true;
  slow.stop();
  serving.join();
}

// Receivers that never answer cost their project time, not the others.
TEST(WebhookSender, OneProjectsDeafReceiversHoldUpNoOther) {
  SenderWorld w;
  Receiver good;
  std::vector<std::unique_ptr<httplib::Server>> deaf;
  std::vector<std::string> theirs;
  const auto add = [&](const std::string& project, int port) {
    const std::string url = "http://127.0.0.1:" + std::to_string(port) + "/hook";
    return w.outbox.ForProject(project)
        .Add(url, "whsec_MfKQ9r8GKYqrTwjUPD8ILPZIo2LaLaSw", R"(["job.cancelled"])")
        .id;
  };
  for (int i = 0; i < 5; ++i) {
    deaf.push_back(std::make_unique<httplib::Server>());
    theirs.push_back(add("greedy", deaf.back()->bind_to_any_port("127.0.0.1")));
  }
  const std::string ours = add("other", good.port);
  for (const char* project : {"greedy", "other"}) {
    JobQueue jobs = w.jobs.ForProject(project);
    jobs.Cancel(jobs.Submit({"build_model", "mdl_x", "{}"}).id);
  }
  WebhookSender sender(w.outbox, {.allow_private_addresses = true, .timeout_seconds = 3});
  w.WaitFor(ours, [](const auto& d) { return d.attempt > 0; });
  int tried = 0;
  for (const std::string& hook : theirs) tried += int(w.outbox.Deliveries(hook, 1).at(0).attempt);
  EXPECT_LE(tried, 1);
}

TEST(WebhookSender, DoesNotGoToPrivateAddressesUnlessAllowed) {
  SenderWorld w;
  Receiver receiver;
  const std::string hook = w.Hook(receiver.port);
  WebhookSender sender(w.outbox, {});
  w.jobs.Cancel(w.jobs.Submit({"build_model", "mdl", "{}"}).id);
  const WebhookDelivery given_up = w.WaitFor(hook, [](const auto& d) { return d.state == "given_up"; });
  EXPECT_NE(given_up.answer.find("private"), std::string::npos);
  EXPECT_TRUE(receiver.taken.empty());
}

}  // namespace
}  // namespace kvx
