// Bodies from which documents are made in memory: few large ones at a time, and one after the other.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/raw_connection.h"
#include "tests/support/running_server.h"

namespace kvx {
namespace {

using testing_support::ExpectProblem;
using testing_support::RawConnection;
using testing_support::RunningServer;

constexpr size_t kPoints = 200'000;

std::string ManyPoints() {
  std::string text = "x,y,z\n";
  for (size_t i = 0; i < kPoints; ++i) text += "1,2,3\n";
  return text;
}

TEST(LargeBodies, AreMadeSomethingOfOneAfterTheOther) {
  RunningServer s;
  const std::string path = "/v1/models/" + s.BuiltModel() + "/points";
  const Json pose{{"joints", {{"tibia.flexion", 35}}}}, points(kPoints, Json{1, 2, 3});
  const std::string body = Json{{"pose", pose}, {"points", points}}.dump();
  ASSERT_GT(body.size(), size_t(1) << 20);
  std::atomic<int> parsing{0}, most_parsing{0}, mapped{0};
  s.world.poser.while_parsing = [&] {
    const int now = ++parsing;
    if (now > most_parsing) most_parsing = now;
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
    --parsing;
  };
  std::vector<std::thread> clients;
  for (int i = 0; i < 4; ++i) {
    clients.emplace_back([&] {
      httplib::Client http("127.0.0.1", s.server.port());
      const auto answer = http.Post(path, body, "application/json");
      mapped += answer && answer->status == 200;
    });
  }
  for (std::thread& client : clients) client.join();
  EXPECT_EQ(mapped, 4);
  EXPECT_EQ(most_parsing, 1);
}

// It may wait for minutes of others' posing.
TEST(LargeBodies, AreNotHeldUpByOneThatIsPosed) {
  RunningServer s;
  const std::string path = "/v1/models/" + s.BuiltModel() + "/points?tibia.flexion=35", points = ManyPoints();
  std::atomic<bool> first{true}, posing{false}, goes_on{false};
  s.world.poser.while_mapping = [&] {
    if (!first.exchange(false)) return;
    posing = true;
    while (!goes_on) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  };
  std::thread held([&] {
    httplib::Client http("127.0.0.1", s.server.port());
    const auto answer = http.Post(path, points, "text/csv");
    EXPECT_TRUE(answer && answer->status == 200);
  });
  while (!posing) std::this_thread::sleep_for(std::chrono::milliseconds(2));
  const auto answer = s.http.Post(path, points, "text/csv");
  EXPECT_TRUE(answer && answer->status == 200);
  goes_on = true;
  held.join();
}

// Filled up with blanks, a few poses kept all other large bodies waiting.
TEST(LargeBodies, NoPoseIsOne) {
  RunningServer s;
  const std::string model = "/v1/models/" + s.BuiltModel();
  const std::string pose = R"({"joints":{"tibia.flexion":35}})", blanks(size_t(1) << 20, ' ');
  for (const char* product : {"/volume", "/field", "/slice", "/surface"}) {
    ExpectProblem(s.http.Post(model + product, pose + blanks, "application/json"), 413);
    const auto answer = s.http.Post(model + product, pose + blanks.substr(pose.size()), "application/json");
    EXPECT_TRUE(answer && answer->status == 200) << product;
  }
}

// Eight that come no further have all places. A place may be free a moment later than the answer comes for
// which it was taken, so one that is turned away for that is followed by another.
TEST(LargeBodies, AreFewAtATimeAndSmallOnesAreNotKeptFromComing) {
  RunningServer s({}, false);
  const std::string path = "/v1/models/mdl_x/points", large = ManyPoints();
  const auto becomes = [&](int status, const std::function<void()>& otherwise) {
    std::string last;
    for (int i = 0; i < 300; ++i) {
      const auto answer = s.http.Post(path, large, "text/csv");
      if (answer && answer->status == status) return testing::AssertionSuccess();
      last = answer ? answer->body : httplib::to_string(answer.error());
      otherwise();
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return testing::AssertionFailure() << "no " << status << " but " << last;
  };
  EXPECT_TRUE(becomes(404, [] {})) << "there is no such model";
  {
    std::vector<std::unique_ptr<RawConnection>> unfinished;
    const auto begin_another = [&] {
      unfinished.push_back(std::make_unique<RawConnection>(s.server.port()));
      unfinished.back()->Send("POST " + path + " HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: " +
                              std::to_string(large.size() + 1) + "\r\n\r\n" + large);
    };
    for (int i = 0; i < 8; ++i) begin_another();
    EXPECT_TRUE(becomes(503, begin_another));
    ExpectProblem(s.http.Post(path, "x,y,z\n1,2,3\n", "text/csv"), 404);
  }
  EXPECT_TRUE(becomes(404, [] {})) << "their places are free again";
}

}  // namespace
}  // namespace kvx
