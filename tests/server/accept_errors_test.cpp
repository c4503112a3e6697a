// Linux passes errors of one connection, and want of files or memory, on to whoever accepts: the service goes
// on after them.
#include <dlfcn.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <future>

#include "tests/support/raw_connection.h"
#include "tests/support/running_server.h"

namespace kvx {
namespace {

using testing_support::RawConnection;
using testing_support::RunningServer;

std::atomic<int> next_error = 0;

void LoseAConnection(int port, int error) {
  next_error = error;
  const RawConnection lost(port);
  for (int i = 0; i < 6000 && next_error != 0; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(5));
  EXPECT_EQ(next_error, 0) << "nobody accepts";
}

}  // namespace

// In place of the system's.
extern "C" int accept4(int socket, sockaddr* address, socklen_t* length, int flags) {
  static const auto systems = reinterpret_cast<decltype(&::accept4)>(::dlsym(RTLD_NEXT, "accept4"));
  const int accepted = systems(socket, address, length, flags);
  const int error = accepted < 0 ? 0 : next_error.exchange(0);
  if (error == 0) return accepted;
  ::close(accepted);
  errno = error;
  return -1;
}

namespace {

TEST(AcceptErrors, OfOneConnectionDoNotEndTheService) {
  RunningServer s({}, false);
  for (const int error : {ECONNABORTED, EPROTO, EPERM, EHOSTUNREACH, ENFILE, ENOBUFS, ENOMEM}) {
    LoseAConnection(s.server.port(), error);
    const auto answer = s.http.Get("/healthz");
    ASSERT_TRUE(answer) << error;
    EXPECT_EQ(answer->status, 200) << error;
  }
}

TEST(AcceptErrors, ASocketThatIsGoneEndsTheServiceAsAFailure) {
  testing_support::ServiceWorld world;
  Metrics metrics;
  HttpServer server(
      world.services, metrics, [] { return std::string(); }, RunningServer::WithFreePort({}));
  auto run = std::async(std::launch::async, [&] { server.Run(); });
  LoseAConnection(server.port(), EBADF);
  EXPECT_THROW(run.get(), Unavailable);
}

}  // namespace
}  // namespace kvx
