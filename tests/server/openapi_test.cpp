// The served document: its examples are accepted and its paths routed.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/document_requests.h"
#include "tests/support/running_server.h"

namespace kvx {
namespace {

using testing_support::RunningServer;

TEST(OpenApi, ItsExamplesAreAccepted) {
  RunningServer s;
  const std::string model = s.BuiltModel();
  const Json record = Json::parse(s.http.Get("/v1/models/" + model)->body);
  const std::map<std::string, std::string> ids{
      {"model", model}, {"subject", record["subject"]}, {"job", record["job"]}};
  const Json document = Json::parse(s.http.Get("/openapi.json")->body);
  EXPECT_EQ(document["openapi"], "3.1.0");
  int sent = 0;
  for (const auto& path : document["paths"].items()) {
    if (!path.value().contains("post") || !path.value()["post"].contains("requestBody")) continue;
    for (const auto& media : path.value()["post"]["requestBody"]["content"].items()) {
      if (!media.value().contains("examples")) continue;
      for (const auto& example : media.value()["examples"].items()) {
        const Json& value = example.value()["value"];
        const std::string body =
            testing_support::Filled(value.is_string() ? value.get<std::string>() : value.dump(), ids);
        const auto result = s.http.Post(testing_support::Filled(path.key(), ids), body, media.key());
        ASSERT_TRUE(result);
        EXPECT_TRUE(path.value()["post"]["responses"].contains(std::to_string(result->status)))
            << path.key() << " '" << example.key() << "': " << result->status << " " << result->body;
        ++sent;
      }
    }
  }
  EXPECT_GE(sent, 8);
}

TEST(OpenApi, EveryPathItNamesIsRouted) {
  RunningServer s;
  const std::string model = s.BuiltModel();
  auto ids = s.IdsAround(model);
  ids["file"] = "start.js";
  const Json document = Json::parse(s.http.Get("/openapi.json")->body);
  for (const auto& path : document["paths"].items()) {
    if (!path.value().contains("get")) continue;
    if (path.key().ends_with("/animations/{job}")) continue;  // HttpServer.AnimationsAreJobsWithAFile
    const std::string url =
        testing_support::Filled(path.key(), ids) + testing_support::RequiredQuery(path.value()["get"]);
    EXPECT_EQ(s.http.Get(url)->status, 200) << path.key();
  }
}

}  // namespace
}  // namespace kvx
