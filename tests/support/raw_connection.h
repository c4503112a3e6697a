// Bytes to a server of loopback and its answers, where it matters what no client library would send.
#pragma once
#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <unistd.h>

#include <string>
#include <utility>

namespace kvx::testing_support {

class RawConnection {
 public:
  explicit RawConnection(int port) {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(uint16_t(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    const timeval patience{.tv_sec = 5, .tv_usec = 0};
    ::setsockopt(socket_, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
    EXPECT_EQ(::connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  }
  ~RawConnection() { ::close(socket_); }
  RawConnection(const RawConnection&) = delete;
  RawConnection& operator=(const RawConnection&) = delete;

  void Send(const std::string& text) const {
    EXPECT_EQ(::send(socket_, text.data(), text.size(), MSG_NOSIGNAL), ssize_t(text.size()));
  }
  // The next answer, header and body; less where it does not come whole.
  std::string Answer() {
    const std::string kEnd = "\r\n\r\n", kLength = "Content-Length: ";
    while (unread_.find(kEnd) == unread_.npos && Receive()) {
    }
    size_t whole = unread_.find(kEnd);
    if (whole == unread_.npos) return std::exchange(unread_, "");
    whole += kEnd.size();
    if (const size_t at = unread_.find(kLength); at < whole)
      whole += std::stoul(unread_.substr(at + kLength.size()));
    while (unread_.size() < whole && Receive()) {
    }
    std::string answer = unread_.substr(0, whole);
    unread_.erase(0, whole);
    return answer;
  }
  // What the server sends is over: it has closed.
  bool Closed() {
    while (Receive()) {
    }
    return ended_;
  }

 private:
  bool Receive() {
    char bytes[4096];
    const ssize_t got = ::recv(socket_, bytes, sizeof bytes, 0);
    ended_ = got == 0;
    if (got > 0) unread_.append(bytes, size_t(got));
    return got > 0;
  }
  const int socket_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  std::string unread_;
  bool ended_ = false;
};

}  // namespace kvx::testing_support
