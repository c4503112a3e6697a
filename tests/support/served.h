// `kinevox serve` as a child process, on a free port of loopback unless told; killed if the test ends first.
#pragma once
#include <signal.h>

#include <nlohmann/json.hpp>
#include <thread>

#include "tests/support/fixtures.h"
#include "tests/support/program.h"

namespace kvx::testing_support {

class Served {
 public:
  explicit Served(const std::filesystem::path& data, const std::vector<std::string>& more = {},
                  const std::string& address = "127.0.0.1:0")
      : program_(output_.path(), Words(data, more, address)) {
    for (int i = 0; i < kPatience && url_.empty() && program_.Running(); ++i) {
      std::this_thread::sleep_for(std::chrono::milliseconds(10));
      for (const auto& entry : std::filesystem::directory_iterator(output_.path())) {
        const std::string text = Content(entry.path());
        if (entry.path().extension() == ".out" && text.ends_with("\n"))
          url_ = nlohmann::json::parse(text)["url"];
      }
    }
  }
  ~Served() { Stop(SIGKILL); }
  Served(const Served&) = delete;
  Served& operator=(const Served&) = delete;
  Ended Stop(int signal) {
    program_.Signal(signal);
    return program_.Wait();
  }
  const std::string& url() const { return url_; }

 private:
  static constexpr int kPatience = 30'000;  // five minutes on a busy machine
  static std::vector<std::string> Words(const std::filesystem::path& data,
                                        const std::vector<std::string>& more, const std::string& address) {
    std::vector<std::string> words{"serve", "--data", data.string(), "--listen", address, "--json"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  }
  ScratchFolder output_;
  Program program_;
  std::string url_;
};

}  // namespace kvx::testing_support
