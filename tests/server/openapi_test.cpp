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

// The page at /docs fills its forms with them: pressing the button must not be refused.
TEST(OpenApi, WhatItProposesTogetherIsAccepted) {
  RunningServer s;
  const auto ids = s.IdsAround(s.BuiltModel());
  const Json document = Json::parse(s.http.Get("/openapi.json")->body);
  int sent = 0;
  for (const auto& path : document["paths"].items()) {
    for (const char* method : {"get", "post", "put"}) {
      const Json operation = path.value().value(method, Json::object());
      const std::string query = testing_support::ProposedQuery(operation);
      if (query.empty()) continue;
      for (const auto& body : testing_support::ExampleBodies(operation, ids)) {
        const auto result =
            testing_support::Send(s.http, method, testing_support::Filled(path.key(), ids) + query, body,
                                  testing_support::RequiredHeaders(operation));
        ASSERT_TRUE(result && *result) << path.key();
        EXPECT_NE((*result)->status, 400) << method << " " << path.key() << query << " " << (*result)->body;
        ++sent;
      }
    }
  }
  EXPECT_GE(sent, 20);
}

TEST(OpenApi, ItsSchemasTakeItsExamples) {
  const testing_support::ApiContract contract(EmbeddedSchema("openapi.json"));
  const Json document = Json::parse(EmbeddedSchema("openapi.json"));
  for (const auto& path : document["paths"].items()) {
    const Json post = path.value().value("post", Json::object());
    for (const auto& body : testing_support::ExampleBodies(post, {})) {
      if (body.type != "application/json") continue;
      EXPECT_EQ(contract.RequestViolation(path.key(), body.text), "");
    }
  }
}

TEST(OpenApi, ItsSchemasRefuseWhatTheServiceRefuses) {
  const testing_support::ApiContract contract(EmbeddedSchema("openapi.json"));
  const std::string model = R"({"subject":"s","template":"t",)", volume = "/v1/models/{model}/volume";
  for (const auto& [path, body] :
       {std::pair{volume, std::string("{}")},
        {volume, R"({"joints":{},"scan":"pose01"})"},
        {volume, R"({"scan":""})"},
        {"/v1/models/{model}/animations", R"({"frames":[{"time":0}]})"},
        {"/v1/models/{model}/points", R"({"points":[[1,2,3]],"unit":"mm"})"},
        {"/v1/models/{model}/points", R"({"points":[[1,null,3]]})"},
        {"/v1/models", model + R"("joints":[{"child":"tibia","dofs":4}]})"},
        {"/v1/models", model + R"("joints":[{"child":"tibia","dofs":1,"axis":[1,0,0]}]})"},
        {"/v1/models", model + R"("joints":[{"child":"tibia","dofs":["a","b","c","d"]}]})"},
        {"/v1/models", model + R"("joints":[{"child":"tibia","dofs":["a b"]}]})"},
        {"/v1/models", model + R"("initial_poses":{"pose01":{"tibia":[1,0,0]}}})"}})
    EXPECT_NE(contract.RequestViolation(path, body), "") << body;
}

// Copies and prints of JSON are recursive: half a megabyte of brackets used up a handler's stack.
TEST(OpenApi, NoBodyIsTooDeepForTheService) {
  constexpr size_t kDeep = 250'000;
  const std::string lists = std::string(kDeep, '[') + std::string(kDeep, ']');
  RunningServer s;
  const std::string model = s.BuiltModel();
  const auto ids = s.IdsAround(model);
  const Json document = Json::parse(s.http.Get("/openapi.json")->body);
  const auto refuses = [&](const std::string& path, const std::string& body) {
    const auto result = s.http.Post(testing_support::Filled(path, ids), body, "application/json");
    ASSERT_TRUE(result) << path;
    // Key frames are read by the poser, whose fake takes any.
    if (!path.ends_with("/animations")) {
      EXPECT_EQ(result->status, 400) << path << " " << result->body;
    }
  };
  int sent = 0;
  for (const auto& path : document["paths"].items()) {
    const Json post = path.value().value("post", Json::object());
    const Json body = post.value("/requestBody/content/application~1json"_json_pointer, Json::object());
    if (body.empty()) continue;
    refuses(path.key(), "{\"unknown\":" + lists + "}");
    const Json examples = body.value("examples", Json::object());
    for (const auto& example : examples.items()) {
      const Json value = example.value()["value"];
      if (!value.is_object()) continue;
      for (const auto& field : value.items()) {
        Json changed = value;
        changed[field.key()] = "HERE";
        std::string text = testing_support::Filled(changed.dump(), ids);
        text.replace(text.find("\"HERE\""), 6, lists);
        refuses(path.key(), text);
        ++sent;
      }
    }
  }
  EXPECT_GE(sent, 8);
  EXPECT_EQ(s.http.Get("/healthz")->status, 200);
}

TEST(OpenApi, EveryPathItNamesIsRouted) {
  RunningServer s;
  const std::string model = s.BuiltModel();
  auto ids = s.IdsAround(model);
  ids["file"] = "start.js";
  const Json document = Json::parse(s.http.Get("/openapi.json")->body);
  for (const auto& path : document["paths"].items()) {
    if (!path.value().contains("get")) continue;
    if (path.key() == "/") continue;                          // HttpServer.OperationsAnswer
    if (path.key().ends_with("/animations/{job}")) continue;  // HttpServer.AnimationsAreJobsWithAFile
    const std::string url =
        testing_support::Filled(path.key(), ids) + testing_support::RequiredQuery(path.value()["get"]);
    EXPECT_EQ(s.http.Get(url)->status, 200) << path.key();
  }
}

// Deletions among them: a slip in a parameter must not do what it was to prevent.
TEST(OpenApi, NoAddressTakesAParameterThatItDoesNotKnow) {
  RunningServer s;
  const std::string model = s.BuiltModel();
  auto ids = s.IdsAround(model);
  ids["file"] = "start.js";
  const Json document = Json::parse(s.http.Get("/openapi.json")->body);
  int sent = 0;
  for (const auto& path : document["paths"].items()) {
    for (const auto& operation : path.value().items()) {
      std::string query = testing_support::RequiredQuery(operation.value());
      query += (query.empty() ? "?" : "&") + std::string("kvx_unknown=1");
      const auto result =
          testing_support::Send(s.http, operation.key(), testing_support::Filled(path.key(), ids) + query,
                                testing_support::ExampleBody(operation.value(), ids),
                                testing_support::RequiredHeaders(operation.value()));
      if (!result) continue;
      ASSERT_TRUE(*result) << path.key();
      const std::string what = operation.key() + " " + path.key() + query + " " + (*result)->body;
      if (path.key().starts_with("/v1/")) {
        EXPECT_EQ((*result)->status, 400) << what;
        EXPECT_TRUE(operation.key() == "head" || (*result)->body.find("kvx_unknown") != std::string::npos)
            << what;
        ++sent;
      } else {
        EXPECT_NE((*result)->status, 400) << "probes may carry any: " << what;
      }
    }
  }
  EXPECT_GE(sent, 45);
  EXPECT_EQ(s.http.Get("/v1/models/" + model)->status, 200);
}

// A client that goes on with a download learns the same of the file.
TEST(OpenApi, ARangeTellsWhatTheWholeDoes) {
  RunningServer s({}, false);
  const Json document = Json::parse(s.http.Get("/openapi.json")->body);
  int files = 0;
  for (const auto& path : document["paths"].items()) {
    for (const auto& method : path.value().items()) {
      const Json responses = method.value().is_object() ? method.value().value("responses", Json()) : Json();
      if (!responses.contains("206")) continue;
      ++files;
      const Json part = responses["206"].value("headers", Json::object());
      EXPECT_TRUE(part.contains("Content-Range")) << path.key();
      for (const auto& header : responses["200"]["headers"].items())
        EXPECT_TRUE(part.contains(header.key())) << path.key() << " " << header.key();
      EXPECT_TRUE(responses.contains("416")) << path.key();
      if (responses.contains("304")) {
        EXPECT_TRUE(responses["304"]["headers"].contains("ETag")) << path.key();
      }
    }
  }
  EXPECT_GT(files, 10);
}

}  // namespace
}  // namespace kvx
