// What the standards of HTTP say of a request's parts, over real sockets.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/running_server.h"

namespace kvx {
namespace {

using testing_support::ExpectProblem;
using testing_support::RunningServer;

TEST(HttpSemantics, AKeyWithAnotherQueryIsAnotherRequest) {
  RunningServer s;
  const httplib::Headers key{{"Idempotency-Key", "k1"}};
  const std::string subject = s.Post("/v1/subjects", {{"region", "knee"}})["id"];
  const auto scan = [&](const char* name) {
    return s.http.Post("/v1/subjects/" + subject + "/scans?filename=a.nii&name=" + name, key, "VOXELS",
                       "application/octet-stream");
  };
  const auto first_scan = scan("i1");
  ASSERT_EQ(first_scan->status, 201);
  EXPECT_EQ(scan("i1")->body, first_scan->body);
  ExpectProblem(scan("i2"), 409);
  EXPECT_EQ(Json::parse(s.http.Get("/v1/subjects/" + subject + "/scans")->body)["items"].size(), 1u);
  const std::string model = s.BuiltModel();
  const auto animation = [&](const char* level) {
    return s.http.Post("/v1/models/" + model + "/animations?level=" + level, key,
                       R"({"frames":[{"time":0,"joints":{}}]})", "application/json");
  };
  const auto first_animation = animation("4");
  ASSERT_EQ(first_animation->status, 202) << first_animation->body;
  EXPECT_EQ(animation("4")->body, first_animation->body);
  ExpectProblem(animation("5"), 409);
}

// A variable that was not set must not show the template as if it were the scan asked for.
TEST(HttpSemantics, EmptyParametersAreNamed) {
  RunningServer s;
  const std::string model = "/v1/models/" + s.BuiltModel();
  const auto expect_named = [](const httplib::Result& result, const std::string& name) {
    ExpectProblem(result, 400);
    EXPECT_THAT(result->body, testing::HasSubstr("the parameter '" + name + "' is empty"));
  };
  expect_named(s.http.Post(model + "/points?scan=", "x,y,z\n1,2,3\n", "text/csv"), "scan");
  expect_named(s.http.Get(model + "/volume?level=2&scan="), "scan");
  expect_named(s.http.Get(model + "/volume?tibia.flexion="), "tibia.flexion");
  expect_named(s.http.Get(model + "/volume?level="), "level");
  expect_named(s.http.Get(model + "/surface?bone="), "bone");
  expect_named(s.http.Get("/v1/models?cursor="), "cursor");
  EXPECT_EQ(s.http.Get(model + "/volume?level=2")->status, 200) << "left out it is the template";
}

}  // namespace
}  // namespace kvx
