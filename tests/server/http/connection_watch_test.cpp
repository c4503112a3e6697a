// Connections that drip headers or bodies byte by byte, or stay when they should go: they need no token, and
// must not take the service away.
#include "server/http/connection_watch.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <future>

#include "server/http/http_context.h"
#include "tests/support/running_server.h"

namespace kvx {
namespace {

using testing_support::RunningServer;
using testing_support::WithKeys;

constexpr char kHost[] = " HTTP/1.1\r\nHost: 127.0.0.1\r\n";
const std::string kEndlessHeader = std::string("GET /healthz") + kHost + "X-A: ";

// Begins as told, and goes on with what it is told to drip.
struct Dripping {
  int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  std::string answer;

  Dripping(int port, const std::string& begin) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(uint16_t(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(socket, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    Send(begin);
  }
  ~Dripping() { ::close(socket); }
  void Send(const std::string& text) const { (void)::send(socket, text.data(), text.size(), MSG_NOSIGNAL); }
  bool Closed() {
    char bytes[4096];
    ssize_t got;
    while ((got = ::recv(socket, bytes, sizeof bytes, MSG_DONTWAIT)) > 0) answer.append(bytes, size_t(got));
    return got == 0 || (errno != EAGAIN && errno != EWOULDBLOCK);
  }
  bool ClosedWithin(std::chrono::seconds patience) {
    const auto until = std::chrono::steady_clock::now() + patience;
    while (!Closed() && std::chrono::steady_clock::now() < until)
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    return Closed();
  }
};

struct Drippers {
  std::vector<std::unique_ptr<Dripping>> all;
  std::atomic<bool> over{false};
  std::thread thread;

  Drippers(int count, int port, const std::string& begin = kEndlessHeader, const std::string& drop = "a") {
    for (int i = 0; i < count; ++i) all.push_back(std::make_unique<Dripping>(port, begin));
    thread = std::thread([this, drop] {
      while (!over) {
        for (const auto& each : all) each->Send(drop);
        std::this_thread::sleep_for(std::chrono::milliseconds(200));
      }
    });
  }
  ~Drippers() {
    over = true;
    thread.join();
  }
};

std::string BodyOf(size_t bytes, const std::string& method_and_path) {
  return method_and_path + kHost + "Content-Length: " + std::to_string(bytes) + "\r\n\r\n";
}

// Room for one request less than drip, and no time limit of its own for them.
HttpOptions FewThreads() {
  HttpOptions options;
  options.threads = 4;
  options.waiting_connections = 2;
  options.header_seconds = 3600;
  return options;
}

void ExpectServedBeside(const HttpOptions& options, const std::string& begin, const std::string& drop) {
  RunningServer s(options, false);
  s.http.set_read_timeout(15);
  const Drippers drippers(5, s.server.port(), begin, drop);
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  const auto answer = s.http.Get("/healthz");
  ASSERT_TRUE(answer) << begin;
  EXPECT_EQ(answer->status, 200) << begin;
}

TEST(ConnectionWatch, OthersAreServedWhereAllThreadsReadHeadersThatDrip) {
  ExpectServedBeside(FewThreads(), kEndlessHeader, "a");
}

// Nobody needs a token to be refused, or to send what no route reads.
TEST(ConnectionWatch, OthersAreServedWhereBodiesDripThatNobodyWants) {
  const HttpOptions options = WithKeys(FewThreads());
  ExpectServedBeside(options, BodyOf(900'000, "POST /v1/subjects/sub_x/scans"), "a");
  ExpectServedBeside(options, BodyOf(60'000, "POST /healthz"), "a");
  ExpectServedBeside(options, BodyOf(60'000, "GET /v1/subjects"), "a");
}

TEST(ConnectionWatch, OthersAreServedWhereClientsStayThatWereToldToGo) {
  ExpectServedBeside(FewThreads(), "", std::string("GET /healthz") + kHost + "\r\n");
}

TEST(ConnectionWatch, AHeaderHasItsTime) {
  HttpOptions options;
  options.header_seconds = 1;
  RunningServer s(options, false);
  const Drippers drippers(1, s.server.port());
  EXPECT_TRUE(drippers.all[0]->ClosedWithin(std::chrono::seconds(60)));
}

TEST(ConnectionWatch, ABodyThatIsNotReadDoesNotKeepTheAnswerBack) {
  RunningServer s({}, false);
  const Drippers drippers(1, s.server.port(), BodyOf(60'000, "POST /healthz"));
  EXPECT_TRUE(drippers.all[0]->ClosedWithin(std::chrono::seconds(10)));
  EXPECT_THAT(drippers.all[0]->answer, testing::StartsWith("HTTP/1.1 405"));
  EXPECT_THAT(drippers.all[0]->answer, testing::HasSubstr("Connection: close"));
}

// What is sent beside the answer must not reset the connection under it.
TEST(ConnectionWatch, WhoSendsAllBeforeItListensStillLearnsWhyItIsRefused) {
  RunningServer s(WithKeys(), false);
  const std::string body(1'500'000, 'V');
  Dripping client(s.server.port(), BodyOf(body.size(), "POST /v1/subjects/sub_x/scans"));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));  // the answer is there already
  client.Send(body);
  EXPECT_TRUE(client.ClosedWithin(std::chrono::seconds(60)));
  EXPECT_THAT(client.answer, testing::StartsWith("HTTP/1.1 401"));
}

// A page of another origin can send any body, but no request that is let in.
TEST(ConnectionWatch, ABodyThatIsNotReadIsNotTakenForRequests) {
  RunningServer s({}, false);
  const std::string subject = "/v1/subjects/" + s.Subject();
  const std::string within = "DELETE " + subject + kHost + "\r\n";
  for (const size_t announced : {within.size(), size_t(100'000), size_t(2'000'000'000)}) {
    for (const char* where : {"POST /healthz", "GET /v1/subjects", "POST /v1/subjects/sub_x/scans"}) {
      Dripping client(s.server.port(), BodyOf(announced, where) + within);
      ::shutdown(client.socket, SHUT_WR);
      EXPECT_TRUE(client.ClosedWithin(std::chrono::seconds(60))) << where;
      EXPECT_EQ(s.http.Get(subject)->status, 200) << where << ", " << announced;
    }
  }
}

TEST(ConnectionWatch, AnUploadThatDripsIsGivenUpAndASlowOneIsTaken) {
  HttpOptions options;
  options.slow_body_seconds = 1;
  RunningServer s(options, false);
  const std::string scans = "POST /v1/subjects/" + s.Subject() + "/scans?filename=a.nii&name=";
  const Drippers drippers(1, s.server.port(), BodyOf(100'000, scans + "dripping"));
  EXPECT_TRUE(drippers.all[0]->ClosedWithin(std::chrono::seconds(60)));
  EXPECT_THAT(drippers.all[0]->answer, testing::HasSubstr("too slowly"));
  const std::string part = "VOXELS" + std::string(199'994, 'V');
  Dripping slow(s.server.port(), BodyOf(2 * part.size(), scans + "slow") + part);
  std::this_thread::sleep_for(std::chrono::milliseconds(1200));
  slow.Send(part);
  for (int i = 0; i < 3000 && slow.answer.empty() && !slow.Closed(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_THAT(slow.answer, testing::StartsWith("HTTP/1.1 201"));
}

// The time to say what it wants has nothing to do with it.
TEST(ConnectionWatch, AnUploadMayPauseButNotForEver) {
  HttpOptions options;
  options.header_seconds = 1;
  RunningServer usual(options, false);
  options.pause_seconds = 1;
  RunningServer impatient(options, false);
  const auto begun = [](RunningServer& s) {
    const std::string scans = "POST /v1/subjects/" + s.Subject() + "/scans?filename=a.nii&name=a";
    return std::make_unique<Dripping>(s.server.port(), BodyOf(12, scans) + "VOXELS");
  };
  const auto kept = begun(usual), given_up = begun(impatient);
  EXPECT_TRUE(given_up->ClosedWithin(std::chrono::seconds(15)));
  EXPECT_THAT(given_up->answer, testing::HasSubstr("broke off"));
  EXPECT_TRUE(kept->answer.empty());
  kept->Send("VOXELS");
  for (int i = 0; i < 3000 && kept->answer.empty() && !kept->Closed(); ++i)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_THAT(kept->answer, testing::StartsWith("HTTP/1.1 201"));
}

TEST(ConnectionWatch, AHeaderThatDripsDoesNotKeepTheServerFromStopping) {
  HttpOptions options;
  options.header_seconds = 3600;
  auto s = std::make_unique<RunningServer>(options, false);
  const Drippers drippers(2, s->server.port());
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  s.reset();  // returns
  EXPECT_TRUE(drippers.all[0]->Closed());
}

TEST(ConnectionWatch, ABodyThatNobodyReadsDoesNotKeepTheServerFromStopping) {
  auto s = std::make_unique<RunningServer>(WithKeys({.header_seconds = 3600}), false);
  const Drippers drippers(2, s->server.port(), BodyOf(900'000, "POST /v1/subjects/sub_x/scans"));
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  const auto begin = std::chrono::steady_clock::now();
  s.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(15));
}

TEST(ConnectionWatch, AnAnswerMayTakeLongerThanAHeader) {
  HttpOptions options;
  options.header_seconds = 1;
  RunningServer s(options, false);
  const std::string job = s.Model()["job"];
  const auto answer = s.http.Get("/v1/jobs/" + job + "?wait=3&after=1000");
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 200);
}

// What has come meanwhile may be TLS's goodbye; who computes asks from threads of its own.
TEST(ConnectionWatch, AClientThatSaidGoodbyeHasGone) {
  int ends[2];
  ASSERT_EQ(::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends), 0);
  ConnectionWatch watch(std::chrono::seconds(60));
  const ConnectionWatch::Connection connection(watch, ends[0]);
  const auto abandoned = ConnectionWatch::ClientGone();
  const auto asked_elsewhere = [&] { return std::async(std::launch::async, abandoned).get(); };
  EXPECT_EQ(::send(ends[1], "goodbye", 7, 0), 7);
  EXPECT_FALSE(abandoned());
  EXPECT_FALSE(asked_elsewhere());
  ::close(ends[1]);
  EXPECT_TRUE(abandoned());
  EXPECT_TRUE(asked_elsewhere());
  ::close(ends[0]);
}

TEST(ConnectionWatch, NobodyMakesOrWaitsForAFieldWhoseClientHasGone) {
  RunningServer s;
  const std::string model = s.BuiltModel();
  testing_support::FakePoser& poser = s.world.poser;
  poser.held = true;
  const std::string ask = "GET /v1/models/" + model + "/field HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n";
  const auto wait = [](const auto& has_come) {
    for (int i = 0; i < 6000 && !has_come(); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    return has_come();
  };
  {
    const Dripping maker(s.server.port(), ask);
    ASSERT_TRUE(wait([&] { return poser.fields == 1; }));
    for (int i = 0; i < 3; ++i) {
      const Dripping waiter(s.server.port(), ask);
      ASSERT_TRUE(wait([&] { return s.world.results.Figures().hits == i + 1; }));
    }
    EXPECT_TRUE(wait([&] { return s.metrics.responses_by_class[4] == 3; })) << "the field is not made yet";
  }
  EXPECT_TRUE(wait([&] { return poser.fields_given_up == 1; }));
  EXPECT_EQ(poser.fields, 1);
}

}  // namespace
}  // namespace kvx
