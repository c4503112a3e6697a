// A server over real sockets, with real storage and fake ports, and a client of it.
#pragma once
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <thread>

#include "api/embedded_schema.h"
#include "api/request.h"
#include "core/text/base64.h"
#include "server/http/http_server.h"
#include "server/http_library.h"
#include "server/jobs/workers.h"
#include "server/log.h"
#include "tests/support/check_contract.h"
#include "tests/support/service_world.h"

namespace kvx::testing_support {

inline HttpOptions WithKeys(HttpOptions options = {}) {
  options.access.api_keys = true;
  return options;
}

struct RunningServer {
  ServiceWorld world;
  Metrics metrics;
  HttpServer server;
  std::thread thread;
  std::unique_ptr<Workers> workers;
  httplib::Client http;

  explicit RunningServer(HttpOptions options = {}, bool with_workers = true)
      : server(
            world.services, metrics, [] { return std::string(); }, WithFreePort(options)),
        thread([this] { server.Run(); }),
        http("127.0.0.1", server.port()) {
    http.set_logger(testing_support::CheckContract);
    if (with_workers) workers = std::make_unique<Workers>(world.services, 1);
  }
  ~RunningServer() {
    world.builder.Open();
    server.Stop();
    thread.join();
  }
  static HttpOptions WithFreePort(HttpOptions options) {
    SetLogLevel("off");
    options.port = 0;
    return options;
  }

  Json Post(const std::string& path, const Json& body) {
    const auto result = http.Post(path, body.dump(), "application/json");
    EXPECT_TRUE(result && result->status < 300) << path << " " << (result ? result->body : "no answer");
    return Json::parse(result->body);
  }
  Json Upload(const std::string& path, const std::string& bytes) {
    const auto result = http.Post(path, bytes, "application/octet-stream");
    EXPECT_TRUE(result && result->status == 201) << (result ? result->body : "no answer");
    return Json::parse(result->body);
  }
  std::string Subject() {
    const std::string id = Post("/v1/subjects", {{"region", "knee"}, {"name", "Jane Roe"}})["id"];
    Upload("/v1/subjects/" + id + "/scans?name=pose00&filename=a.nii", "VOXELS0");
    Upload("/v1/subjects/" + id + "/scans?name=pose01&filename=a.nii", "VOXELS1");
    Upload("/v1/subjects/" + id + "/bones?template=pose00", "VOXELSb");
    return id;
  }
  // Where a record of a built model's world lies: what stands in the paths of the document, and its id.
  std::map<std::string, std::string> IdsAround(const std::string& model) {
    const Json record = Json::parse(http.Get("/v1/models/" + model)->body);
    const std::string subject = record["subject"];
    const Json scans = Json::parse(http.Get("/v1/subjects/" + subject + "/scans")->body);
    const std::string bones = Upload("/v1/subjects/" + subject + "/bones?template=pose00", "VOXELSc")["id"];
    const std::string coded =
        "subject " + Base64(subject) + ",name " + Base64("more") + ",filename " + Base64("a.nii");
    const auto upload = http.Post(
        "/v1/uploads",
        httplib::Headers{{"Tus-Resumable", "1.0.0"}, {"Upload-Length", "9"}, {"Upload-Metadata", coded}});
    const std::string location = upload->get_header_value("Location");
    const Json models = Json::array({Json{{"subject", subject}, {"template", "pose00"}}});
    return {{"model", model},
            {"subject", subject},
            {"job", record["job"]},
            {"scan", scans["items"][0]["id"]},
            {"bones", bones},
            {"upload", location.substr(location.rfind('/') + 1)},
            {"batch", Post("/v1/batches", {{"models", models}})["id"]},
            {"webhook", Post("/v1/webhooks", {{"url", "http://a.example"}})["id"]}};
  }
  Json Model() { return Post("/v1/models", {{"subject", Subject()}, {"template", "pose00"}}); }
  Json WaitFor(const std::string& job) {
    for (int i = 0; i < 400; ++i) {
      const Json state = Json::parse(http.Get("/v1/jobs/" + job)->body);
      if (state["state"] != "queued" && state["state"] != "running") return state;
      std::this_thread::sleep_for(std::chrono::milliseconds(25));
    }
    ADD_FAILURE() << "the job does not end";
    return {};
  }
  std::string BuiltModel() {
    const Json model = Model();
    EXPECT_EQ(WaitFor(model["job"])["state"], "succeeded");
    return model["id"];
  }
};

inline void ExpectProblem(const httplib::Result& result, int status) {
  ASSERT_TRUE(result);
  EXPECT_EQ(result->status, status) << result->body;
  EXPECT_EQ(result->get_header_value("Content-Type"), "application/problem+json");
  const Json problem = Json::parse(result->body);
  EXPECT_EQ(problem["status"], status);
  EXPECT_EQ(problem["instance"], "urn:kinevox:request:" + result->get_header_value("X-Request-Id"));
  for (const char* field : {"type", "title", "detail"}) EXPECT_TRUE(problem[field].is_string()) << field;
}

}  // namespace kvx::testing_support
