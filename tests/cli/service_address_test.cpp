// What clients make of what answers at --server, of KINEVOX_TOKEN, and of ids.
#include <gmock/gmock.h>

#include <cstdlib>

#include "tests/support/program_test.h"
#include "tests/support/scripted_service.h"

namespace kvx {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing_support::Ended;
using testing_support::ScriptedService;

class ServiceAddress : public testing_support::ProgramTest {
 protected:
  ~ServiceAddress() override { unsetenv("KINEVOX_TOKEN"); }
};

TEST_F(ServiceAddress, ARedirectIsToldWithItsAddress) {
  testing_support::ListeningServer server;
  std::string to = "https://kinevox.example:8443/v1/jobs?limit=50";
  server.http.Get(".*", [&](const httplib::Request&, httplib::Response& r) { r.set_redirect(to, 301); });
  server.Listen();
  const auto jobs = [&] { return Run({"jobs", "--server", server.url()}); };
  const Ended moved = jobs();
  EXPECT_EQ(moved.code, 4);
  EXPECT_THAT(moved.err,
              HasSubstr("the service is at https://kinevox.example:8443; give that with --server"));
  to = "/login";
  EXPECT_THAT(jobs().err, HasSubstr("is not a kinevox service"));
  to = "https://kinevox.example/";
  EXPECT_THAT(Run({"fetch", "mdl_1", "--scan", "a", "--out", At("a.nrrd"), "--server", server.url()}).err,
              HasSubstr("https://kinevox.example;"));
}

TEST_F(ServiceAddress, ATokenLosesWhatAFileAddsToIt) {
  testing_support::ListeningServer server;
  std::string sent;
  server.http.Get("/v1/jobs", [&](const httplib::Request& q, httplib::Response& r) {
    sent = q.get_header_value("Authorization");
    ScriptedService::Say(r, 200, {{"items", nlohmann::json::array()}});
  });
  server.Listen();
  setenv("KINEVOX_TOKEN", " kvx_key\r\n", 1);
  EXPECT_EQ(Run({"jobs", "--server", server.url()}).code, 0);
  EXPECT_EQ(sent, "Bearer kvx_key");
  for (const char* broken : {"kvx_a\nkvx_b", "kvx_a kvx_b", "kvx_\x01"}) {
    setenv("KINEVOX_TOKEN", broken, 1);
    const Ended ended = Run({"jobs", "--server", server.url()});
    EXPECT_EQ(ended.code, 2);
    EXPECT_THAT(ended.err, HasSubstr("KINEVOX_TOKEN"));
    EXPECT_THAT(ended.err, Not(HasSubstr("kvx_"))) << "a secret";
  }
}

TEST_F(ServiceAddress, ABatchsJobsAreListedByItsId) {
  ScriptedService service;
  service.get_batch = [](const httplib::Request&, httplib::Response& r) {
    nlohmann::json batch = ScriptedService::BatchOf(2, "running");
    batch["models"][1]["subject_name"] = "knee-b";
    ScriptedService::Say(r, 200, batch);
  };
  service.Listen();
  const Ended ended = Run({"jobs", "bat_1", "--server", service.url()});
  EXPECT_EQ(ended.code, 0) << ended.err;
  EXPECT_THAT(ended.out, HasSubstr("job_1  running"));
  EXPECT_THAT(ended.out, HasSubstr("job_2  running"));
  EXPECT_THAT(ended.out, HasSubstr("mdl_2  knee-b\n"));
  EXPECT_EQ(RunJson({"jobs", "bat_1", "--server", service.url()})["models"].size(), 2u);
}

}  // namespace
}  // namespace kvx
