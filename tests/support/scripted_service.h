// A service of a test's own that knows one batch of models: as much as 'kinevox submit' asks for. What it
// answers otherwise is set before Listen.
#pragma once
#include <atomic>
#include <nlohmann/json.hpp>

#include "tests/support/listening_server.h"

namespace kvx::testing_support {

// Subjects and jobs are counted: sub_1, job_1 of the first study. All files are here already, the bones among
// them.
class ScriptedService {
 public:
  using Handler = std::function<void(const httplib::Request&, httplib::Response&)>;

  ScriptedService() {
    get_bones = [](const httplib::Request&, httplib::Response& r) { SayBones(r, {"bon_1"}); };
    put_scan = [](const httplib::Request&, httplib::Response& r) { Say(r, 201, {{"id", "scn_1"}}); };
    post_batch = [](const httplib::Request& q, httplib::Response& r) {
      const size_t count = nlohmann::json::parse(q.body)["models"].size();
      Say(r, 202, BatchOf(count, "queued"));
    };
    get_ready = [](const httplib::Request&, httplib::Response& r) { Say(r, 200, {{"status", "ready"}}); };
    get_batch = [](const httplib::Request&, httplib::Response& r) { Say(r, 404, {{"detail", "no batch"}}); };
    get_job = [](const httplib::Request& q, httplib::Response& r) {
      Say(r, 200, {{"id", q.matches[1].str()}, {"state", "succeeded"}, {"created", "2026"}});
    };
  }
  static void Say(httplib::Response& r, int status, const nlohmann::json& body) {
    r.status = status;
    r.set_content(body.dump(), status < 400 ? "application/json" : "application/problem+json");
  }
  static nlohmann::json BatchOf(size_t count, const char* state) {
    nlohmann::json models = nlohmann::json::array();
    for (size_t i = 1; i <= count; ++i) {
      const std::string number = std::to_string(i);
      models.push_back({{"id", "mdl_" + number},
                        {"job", "job_" + number},
                        {"state", state},
                        {"stage", ""},
                        {"progress", 0},
                        {"earlier", false},
                        {"batch", "bat_1"}});
    }
    return {{"id", "bat_1"}, {"models", models}};
  }
  // The list of a subject's label maps: newest first.
  static void SayBones(httplib::Response& r, const std::vector<std::string>& ids) {
    nlohmann::json items = nlohmann::json::array();
    for (const std::string& id : ids) items.push_back({{"id", id}, {"template", "pose00"}});
    Say(r, 200, {{"items", items}, {"next", nullptr}});
  }
  void Listen() {
    httplib::Server& http = server_.http;
    http.Post("/v1/subjects", [this](const httplib::Request&, httplib::Response& r) {
      Say(r, 201, {{"id", "sub_" + std::to_string(++subjects_)}});
    });
    http.Get("/v1/subjects/[^/]+/scans", [](const httplib::Request&, httplib::Response& r) {
      Say(r, 200, {{"items", nlohmann::json::array()}, {"next", nullptr}});
    });
    http.Get("/v1/subjects/[^/]+/bones", get_bones);
    http.Post("/v1/subjects/[^/]+/bones", [](const httplib::Request&, httplib::Response& r) {
      Say(r, 201, {{"id", "bon_sent"}, {"template", "pose00"}});
    });
    http.Put("/v1/subjects/[^/]+/scans/.*", put_scan);
    http.Get("/v1/jobs", [](const httplib::Request&, httplib::Response& r) {
      Say(r, 200, {{"items", nlohmann::json::array()}});
    });
    http.Post("/v1/models", [this](const httplib::Request& q, httplib::Response& r) {
      asked = nlohmann::json::parse(q.body);
      Say(r, 202, {{"id", "mdl_1"}, {"job", "job_1"}, {"state", "queued"}});
    });
    http.Post("/v1/batches", post_batch);
    http.Get("/v1/batches/.*", get_batch);
    http.Get("/v1/jobs/(.*)", get_job);
    http.Get("/readyz", get_ready);
    server_.Listen();
  }
  std::string url() const { return server_.url(); }

  Handler get_bones, put_scan, post_batch, get_batch, get_job, get_ready;
  nlohmann::json asked;  // the last POST /v1/models

 private:
  std::atomic<int> subjects_ = 0;
  ListeningServer server_;
};

}  // namespace kvx::testing_support
