// A server of a test's own, for programs of ours that ask others: what it answers is said before Listen.
#pragma once
#include <string>
#include <thread>

#include "server/http_library.h"

namespace kvx::testing_support {

class ListeningServer {
 public:
  ~ListeningServer() { Stop(); }
  void Listen() {
    port_ = http.bind_to_any_port("127.0.0.1");
    thread_ = std::thread([this] { http.listen_after_bind(); });
    http.wait_until_ready();
  }
  void Stop() {
    http.stop();
    if (thread_.joinable()) thread_.join();
  }
  int port() const { return port_; }
  std::string url() const { return "http://127.0.0.1:" + std::to_string(port_); }

  httplib::Server http;

 private:
  int port_ = 0;
  std::thread thread_;
};

}  // namespace kvx::testing_support
