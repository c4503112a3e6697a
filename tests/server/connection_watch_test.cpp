// Connections that drip their header byte by byte: they need no token, and must not take the service away.
#include "server/connection_watch.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include "tests/support/running_server.h"

namespace kvx {
namespace {

using testing_support::RunningServer;

// Sends a header that never ends.
struct Dripping {
  int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);

  explicit Dripping(int port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(uint16_t(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::connect(socket, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    Send("GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\nX-A: ");
  }
  ~Dripping() { ::close(socket); }
  void Send(const std::string& text) const { (void)::send(socket, text.data(), text.size(), MSG_NOSIGNAL); }
  bool Closed() const {
    char byte;
    const ssize_t got = ::recv(socket, &byte, 1, MSG_DONTWAIT);
    return got == 0 || (got < 0 && errno != EAGAIN && errno != EWOULDBLOCK);
  }
};

struct Drippers {
  std::vector<std::unique_ptr<Dripping>> all;
  std::atomic<bool> over{false};
  std::thread thread;

  Drippers(int count, int port) {
    for (int i = 0; i < count; ++i) all.push_back(std::make_unique<Dripping>(port));
    thread = std::thread([this] {
      while (!over) {
        for (const auto& each : all) each->Send("a");
        std::this_thread::sleep_for(std::chrono::milliseconds(200));
      }
    });
  }
  ~Drippers() {
    over = true;
    thread.join();
  }
};

TEST(ConnectionWatch, OthersAreServedWhereAllThreadsReadHeadersThatDrip) {
  HttpOptions options;
  options.threads = 4;
  options.waiting_connections = 2;
  options.header_seconds = 3600;
  RunningServer s(options, false);
  s.http.set_read_timeout(60);
  const Drippers drippers(5, s.server.port());
  std::this_thread::sleep_for(std::chrono::milliseconds(300));
  const auto answer = s.http.Get("/healthz");
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 200);
}

TEST(ConnectionWatch, AHeaderHasItsTime) {
  HttpOptions options;
  options.header_seconds = 1;
  RunningServer s(options, false);
  const Drippers drippers(1, s.server.port());
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  while (!drippers.all[0]->Closed() && std::chrono::steady_clock::now() < until)
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_TRUE(drippers.all[0]->Closed());
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

TEST(ConnectionWatch, AnAnswerMayTakeLongerThanAHeader) {
  HttpOptions options;
  options.header_seconds = 1;
  RunningServer s(options, false);
  const std::string job = s.Model()["job"];
  const auto answer = s.http.Get("/v1/jobs/" + job + "?wait=3&after=1000");
  ASSERT_TRUE(answer);
  EXPECT_EQ(answer->status, 200);
}

}  // namespace
}  // namespace kvx
