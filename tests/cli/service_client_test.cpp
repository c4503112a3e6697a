// The client against a real server whose answers are scripted: busy ones are waited out, others are not.
#include "cli/service_client.h"

#include <gtest/gtest.h>

#include <atomic>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>

#include "server/http_library.h"

namespace kvx {
namespace {

// Answers with these states one after the other, then with 200 and {"tries": how many}.
class Scripted {
 public:
  explicit Scripted(std::vector<int> states) : states_(std::move(states)) {
    const auto answer = [this](const httplib::Request& request, httplib::Response& response) {
      keys_.insert(request.get_header_value("Idempotency-Key"));
      const size_t n = tries_++;
      response.status = n < states_.size() ? states_[n] : 200;
      response.set_header("Retry-After", "0");
      response.set_content(R"({"tries": )" + std::to_string(n + 1) + R"(, "detail": "said so"})",
                           "application/json");
    };
    server_.Get(".*", answer);
    server_.Post(".*", answer);
    port_ = server_.bind_to_any_port("127.0.0.1");
    thread_ = std::thread([this] { server_.listen_after_bind(); });
    server_.wait_until_ready();
  }
  ~Scripted() {
    server_.stop();
    thread_.join();
  }
  std::string url() const { return "http://127.0.0.1:" + std::to_string(port_); }
  size_t tries() const { return tries_; }
  const std::set<std::string>& keys() const { return keys_; }

 private:
  std::vector<int> states_;
  std::atomic<size_t> tries_ = 0;
  std::set<std::string> keys_;
  httplib::Server server_;
  int port_ = 0;
  std::thread thread_;
};

TEST(ServiceClient, WaitsOutABusyService) {
  const Scripted service({429, 503, 502, 504});
  EXPECT_EQ(ServiceClient(service.url()).GetPatiently("/v1/jobs/a")["tries"], 5);
}

TEST(ServiceClient, SendsAgainUnderTheSameKey) {
  const Scripted service({502, 429});
  EXPECT_EQ(ServiceClient(service.url()).Post("/v1/models", ServiceJson::object())["tries"], 3);
  EXPECT_EQ(service.keys().size(), 1u);
}

TEST(ServiceClient, ARefusalIsFinal) {
  const Scripted wrong({400, 200}), large({413}), gone({404});
  EXPECT_THROW(ServiceClient(wrong.url()).Post("/v1/models", ServiceJson::object()), InputError);
  EXPECT_EQ(wrong.tries(), 1u);
  EXPECT_THROW(ServiceClient(large.url()).Post("/v1/models", ServiceJson::object()), TooLarge);
  EXPECT_THROW(ServiceClient(gone.url()).GetPatiently("/v1/jobs/a"), NotFound);
}

TEST(ServiceClient, WithoutPatienceItSaysThatTheServiceIsBusy) {
  const Scripted service({429});
  EXPECT_THROW(ServiceClient(service.url()).Get("/v1/jobs"), Refused);
}

}  // namespace
}  // namespace kvx
