// Settings of the service: where they come from, and which are refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "tests/support/environment.h"
#include "tests/support/program_test.h"

namespace kvx {
namespace {

using testing::HasSubstr;
using testing_support::Ended;
using testing_support::Environment;

class Configuration : public testing_support::ProgramTest {};

TEST_F(Configuration, TheCommandLineOverrulesTheEnvironmentAndThatTheFile) {
  std::ofstream(At("a.toml"))
      << "[server]\nlisten = \"127.0.0.1:1\"\nworkers = 2\nlog = \"warn\"\nhosts = [\"a.example\"]\n"
         "[limits]\nupload_gib = 1\n";
  const Environment workers("KINEVOX_SERVER_WORKERS", "3"), log("KINEVOX_SERVER_LOG", "error");
  const Ended ended = Run({"serve", "--config", At("a.toml"), "--log", "off", "--set",
                           "limits.requests_per_minute=7", "--print-config"});
  ASSERT_EQ(ended.code, 0) << ended.err;
  for (const char* line : {"listen = '127.0.0.1:1'", "workers = 3", "log = 'off'", "hosts = [ 'a.example' ]",
                           "upload_gib = 1.0", "requests_per_minute = 7", "api_keys = false"}) {
    EXPECT_THAT(ended.out, HasSubstr(std::string(line) + "  #"));
  }
  std::ofstream(At("b.toml")) << ended.out;
  EXPECT_EQ(Run({"serve", "--config", At("b.toml"), "--log", "off", "--print-config"}).out.substr(0, 100),
            ended.out.substr(0, 100))
      << "what is printed can be read";
}

TEST_F(Configuration, WrongSettingsAreNamed) {
  const auto refusal = [&](const std::string& toml) {
    std::ofstream(At("a.toml")) << toml;
    const Ended ended = Run({"serve", "--config", At("a.toml"), "--print-config"});
    EXPECT_EQ(ended.code, 3) << toml;
    return ended.err;
  };
  EXPECT_THAT(refusal("[server]\nport = 1\n"), HasSubstr("server.port"));
  EXPECT_THAT(refusal("[server]\nworkers = \"two\"\n"), HasSubstr("'server.workers' is a whole number"));
  EXPECT_THAT(refusal("[server\n"), HasSubstr("line 1"));
  EXPECT_THAT(refusal("workers = 2\n"), HasSubstr("[section]"));
  EXPECT_THAT(refusal("[server]\nworkers = \"two\"\n"), HasSubstr(At("a.toml")));
  EXPECT_EQ(Run({"serve", "--set", "server.nothing=1", "--print-config"}).code, 3);
}

TEST_F(Configuration, ValuesThatCannotWorkAreRefusedWithWhatTheSettingTakes) {
  const auto expect_refused = [&](const std::string& name, const std::string& value,
                                  const std::string& takes) {
    const Ended ended = Run({"serve", "--set", name + "=" + value, "--print-config"});
    EXPECT_EQ(ended.code, 3) << name << " = " << value;
    EXPECT_THAT(ended.err, HasSubstr("'" + name + "'"));
    EXPECT_THAT(ended.err, HasSubstr(takes));
  };
  expect_refused("server.log", "loud", "info, warn, error or off");
  expect_refused("limits.requests_per_minute", "-5", "from 0");
  expect_refused("server.drain_seconds", "-3", "from 0 to 3600");
  expect_refused("limits.least_free_gib", "nan", "from 0");
  expect_refused("server.lease_seconds", "nan", "from 0.5");
  expect_refused("limits.upload_gib", "0", "from");
  for (const char* origin : {"*", "viewer.example", "https://x/path", "https://x/", "ftp://x", "https://X"})
    expect_refused("server.cors_origins", origin, "https://viewer.example");
  for (const char* host : {"a.example:8080", "http://a.example", "*.example", "a.example/", "a..b"})
    expect_refused("server.hosts", host, "without http://, port");
  EXPECT_EQ(Run({"serve", "--set", "server.hosts=a.example,10.0.0.7,::1,pacs", "--print-config"}).code, 0);
  expect_refused("server.cors_origins", "[\"https://viewer.example\"]", "a,b");
  const Ended two =
      Run({"serve", "--set", "server.cors_origins=https://a.example,http://[::1]:3000", "--print-config"});
  EXPECT_THAT(two.out, HasSubstr("[ 'https://a.example', 'http://[::1]:3000' ]")) << two.err;
}

// What is left of the configuration would be a service that asks nobody who they are.
TEST_F(Configuration, AuthenticationThatIsHalfConfiguredIsRefused) {
  const std::string issuer = "auth.oidc_issuer=https://id.example", audience = "auth.oidc_audience=kinevox",
                    keys = "auth.oidc_jwks=https://id.example/keys";
  const auto code = [&](const std::vector<std::string>& settings) {
    std::vector<std::string> words{"serve", "--print-config"};
    for (const std::string& setting : settings) words.insert(words.end(), {"--set", setting});
    return Run(words).code;
  };
  EXPECT_EQ(code({issuer, audience, keys}), 0);
  for (const auto& some : std::vector<std::vector<std::string>>{
           {issuer}, {audience}, {keys}, {audience, keys}, {issuer, keys}, {issuer, audience}})
    EXPECT_EQ(code(some), 3) << some[0];
  std::filesystem::create_directory(At("kinevox.d"));
  const Ended folder = Run({"serve", "--config", At("kinevox.d"), "--print-config"});
  EXPECT_EQ(folder.code, 3) << "it was read as an empty file";
  EXPECT_THAT(folder.err, HasSubstr(At("kinevox.d")));
}

TEST_F(Configuration, VariablesThatAreNoSettingAreNamed) {
  {
    const Environment slip("KINEVOX_SERVER_WORKER", "1");
    const Ended ended = Run({"serve", "--print-config"});
    EXPECT_EQ(ended.code, 3);
    EXPECT_THAT(ended.err, HasSubstr("KINEVOX_SERVER_WORKER"));
  }
  const Environment foreign("KINEVOX_PORT", "tcp://10.0.0.1:80"), ours("KINEVOX_CA", "ca.pem");
  const Ended ended = Run({"serve", "--print-config"});
  EXPECT_EQ(ended.code, 0) << "an orchestrator may have set it";
  EXPECT_THAT(ended.err, HasSubstr("KINEVOX_PORT"));
  EXPECT_THAT(ended.err, testing::Not(HasSubstr("KINEVOX_CA")));
}

}  // namespace
}  // namespace kvx
