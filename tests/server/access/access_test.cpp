// Keys, tokens, projects, limits, other origins and TLS over real sockets, with real keys and certificates.
#include "server/access/access.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <chrono>

#include "api/errors.h"
#include "tests/support/document_requests.h"
#include "tests/support/raw_connection.h"
#include "tests/support/running_server.h"
#include "tests/support/signing.h"

namespace kvx {
namespace {

using testing::HasSubstr;
using testing_support::ExpectProblem;
using testing_support::RawConnection;
using testing_support::RunningServer;
using testing_support::SelfSigned;
using testing_support::TokenSigner;
using testing_support::WithKeys;

std::string KeyFor(RunningServer& s, const std::string& project, AccessScope scope = AccessScope::kAdmin,
                   Quota quota = {}) {
  return s.world.keys.Add({"test", project, scope, quota, std::nullopt}).text;
}

httplib::Headers As(const std::string& token) { return {{"Authorization", "Bearer " + token}}; }

TEST(Access, WithoutAKeyNothingIsSaidButWhetherItLives) {
  RunningServer s(WithKeys(), false);
  for (const char* open : {"/healthz", "/readyz", "/openapi.json"})
    EXPECT_EQ(s.http.Get(open)->status, 200) << open;
  for (const char* path :
       {"/v1/subjects", "/v1/models", "/v1/jobs", "/metrics", "/v1/models/mdl_x/volume", "/v1/audit"}) {
    const auto answer = s.http.Get(path);
    ExpectProblem(answer, 401);
    EXPECT_THAT(answer->get_header_value("WWW-Authenticate"), HasSubstr("Bearer"));
  }
  for (const char* token : {"x", "kvx.key_1.2", "eyJhbGciOiJub25lIn0.e30."})
    ExpectProblem(s.http.Get("/v1/jobs", As(token)), 401);
  EXPECT_EQ(s.http.Get("/v1/subjects", As(KeyFor(s, "lab")))->status, 200);
}

// Of two streams, one project has one.
TEST(Access, StreamsOfOneProjectLeaveSomeToOthers) {
  HttpOptions options = WithKeys();
  options.event_streams = 2;
  RunningServer s(options, false);
  const auto job_of = [&](const std::string& project) {
    ProjectServices own(s.world.services, project);
    return "/v1/jobs/" + own.services.jobs.Submit({"build_model", "", "{}"}).id;
  };
  const std::string job = job_of("lab"), job_of_others = job_of("clinic");
  const std::string key = KeyFor(s, "lab"), key_of_others = KeyFor(s, "clinic");
  RawConnection stream(s.server.port());
  stream.Send("GET " + job + "/events HTTP/1.1\r\nHost: 127.0.0.1\r\nAuthorization: Bearer " + key +
              "\r\n\r\n");
  EXPECT_THAT(stream.Answer(), testing::StartsWith("HTTP/1.1 200"));
  ExpectProblem(s.http.Get(job + "/events", As(key)), 503);
  const auto wait = s.http.Get(job + "?wait=5", As(key));
  ExpectProblem(wait, 503);
  EXPECT_TRUE(wait->has_header("Retry-After")) << "whoever waits in vain must not ask again at once";
  EXPECT_EQ(s.http.Get(job + "?after=0", As(key))->status, 200) << "there is news: nobody has to wait";
  const auto begin = std::chrono::steady_clock::now();
  EXPECT_EQ(s.http.Get(job_of_others + "?wait=1", As(key_of_others))->status, 200);
  EXPECT_GE(std::chrono::steady_clock::now() - begin, std::chrono::seconds(1));
  EXPECT_THAT(s.http.Get("/metrics", As(key))->body, HasSubstr("kinevox_event_streams 1\n"));
}

// Anybody can be refused as often as they like: that must not fill the disk. One a second comes back.
TEST(Access, RefusalsThatAreKeptAreLimited) {
  RunningServer s(WithKeys(), false);
  const auto begin = std::chrono::steady_clock::now();
  for (int i = 0; i < 100; ++i) ExpectProblem(s.http.Get("/v1/subjects"), 401);
  const std::chrono::duration<double> took = std::chrono::steady_clock::now() - begin;
  const int64_t kept = s.world.audit.Verify().entries;
  EXPECT_GE(kept, 60);
  EXPECT_LE(double(kept), 61 + took.count());
}

TEST(Access, ScopesHoldEachOther) {
  RunningServer s(WithKeys(), false);
  const auto read = As(KeyFor(s, "lab", AccessScope::kRead)),
             write = As(KeyFor(s, "lab", AccessScope::kWrite)), admin = As(KeyFor(s, "lab"));
  const std::string body = R"({"region":"knee"})";
  ExpectProblem(s.http.Post("/v1/subjects", read, body, "application/json"), 403);
  const auto made = s.http.Post("/v1/subjects", write, body, "application/json");
  ASSERT_EQ(made->status, 201);
  const std::string path = made->get_header_value("Location");
  EXPECT_EQ(s.http.Get(path, read)->status, 200);
  ExpectProblem(s.http.Delete(path, write), 403);
  ExpectProblem(s.http.Get("/v1/audit", write), 403);
  EXPECT_EQ(s.http.Delete(path, admin)->status, 204);
  ExpectProblem(s.http.Get(path, read), 404);
}

// Every address of the document that holds an id, asked by another project's admin.
TEST(Access, IdsOfAnotherProjectAreNotThere) {
  RunningServer s(WithKeys());
  s.http.set_default_headers(As(KeyFor(s, "mine")));
  const std::string model = s.BuiltModel();
  const auto ids = s.IdsAround(model);
  const Json document = Json::parse(s.http.Get("/openapi.json")->body);
  s.http.set_default_headers(As(KeyFor(s, "theirs")));
  int asked = 0;
  for (const auto& path : document["paths"].items()) {
    if (path.key().find('{') == std::string::npos) continue;
    const std::string address = testing_support::Filled(path.key(), ids);
    if (address.find('{') != std::string::npos) continue;  // of a file of this service, not of a record
    for (const auto& operation : path.value().items()) {
      const std::string query = testing_support::RequiredQuery(operation.value());
      const auto answer = testing_support::Send(s.http, operation.key(), address + query,
                                                testing_support::ExampleBody(operation.value(), ids),
                                                testing_support::RequiredHeaders(operation.value()));
      if (!answer) continue;
      if (operation.key() == "head")
        EXPECT_EQ((*answer)->status, 404) << address;
      else
        ExpectProblem(*answer, 404);
      EXPECT_EQ((*answer)->body.find("Jane Roe"), std::string::npos);
      ++asked;
    }
  }
  EXPECT_GE(asked, 20);
  for (const char* list : {"/v1/subjects", "/v1/models", "/v1/jobs", "/v1/batches", "/v1/webhooks"}) {
    EXPECT_TRUE(Json::parse(s.http.Get(list)->body)["items"].empty()) << list;
  }
  const Json theft{{"subject", ids.at("subject")}, {"template", "pose00"}};
  ExpectProblem(s.http.Post("/v1/models", theft.dump(), "application/json"), 404);
}

TEST(Access, RatesAndBytesAreLimited) {
  RunningServer s(WithKeys(), false);
  const auto key = As(KeyFor(s, "lab", AccessScope::kWrite, {3, 40}));
  for (int i = 2; i >= 0; --i) {
    const auto answer = s.http.Get("/v1/jobs", key);
    EXPECT_EQ(answer->status, 200);
    EXPECT_EQ(answer->get_header_value("RateLimit-Policy"), "\"requests\";q=3;w=60, \"bytes\";q=40;w=86400");
    EXPECT_THAT(answer->get_header_value("RateLimit"),
                testing::StartsWith("\"requests\";r=" + std::to_string(i) + ";t="));
  }
  const auto refused = s.http.Get("/v1/jobs", key);
  ExpectProblem(refused, 429);
  EXPECT_GT(std::stoi(refused->get_header_value("Retry-After")), 0);

  const auto bytes = As(KeyFor(s, "lab", AccessScope::kWrite, {std::nullopt, 40}));
  const std::string body = R"({"region":"knee"})";  // 17 bytes
  EXPECT_EQ(s.http.Post("/v1/subjects", bytes, body, "application/json")->status, 201);
  const auto taken = s.http.Post("/v1/subjects", bytes, body, "application/json");
  EXPECT_EQ(taken->status, 201);
  EXPECT_EQ(taken->get_header_value("RateLimit-Policy"), "\"bytes\";q=40;w=86400");
  EXPECT_THAT(taken->get_header_value("RateLimit"), testing::StartsWith("\"bytes\";r=6;t="));
  const auto beyond = s.http.Post("/v1/subjects", bytes, body, "application/json");
  ExpectProblem(beyond, 429);
  EXPECT_THAT(beyond->get_header_value("RateLimit"), testing::StartsWith("\"bytes\";r=6;t="));
  const int wait_s = std::stoi(beyond->get_header_value("Retry-After"));
  EXPECT_TRUE(wait_s > 0 && wait_s <= 86400) << "until the day ends (UTC)";
  const auto both = As(KeyFor(s, "lab", AccessScope::kWrite, {3, 40}));
  EXPECT_EQ(s.http.Post("/v1/subjects", both, body, "application/json")->get_header_value("RateLimit-Policy"),
            "\"requests\";q=3;w=60, \"bytes\";q=40;w=86400");
  const auto chunks = [](size_t, httplib::DataSink& sink) {
    sink.done();
    return true;
  };
  ExpectProblem(s.http.Post("/v1/subjects", bytes, chunks, "application/json"), 411);
}

TEST(Access, UploadsAreInspectedInTheNameOfTheirProject) {
  RunningServer s(WithKeys(), false);
  s.http.set_default_headers(As(KeyFor(s, "lab")));
  s.Subject();
  EXPECT_EQ(s.world.inspector.projects, std::set<std::string>{"lab"});
}

TEST(RateLimiter, RequestsComeBackEvenly) {
  int64_t now_ms = 0;
  RateLimiter rates([&] { return now_ms; });
  for (int i = 0; i < 60; ++i) EXPECT_FALSE(rates.Take("a", 60).exceeded);
  EXPECT_TRUE(rates.Take("a", 60).exceeded);
  EXPECT_FALSE(rates.Take("b", 60).exceeded) << "each has their own";
  now_ms += 1000;
  EXPECT_FALSE(rates.Take("a", 60).exceeded);
  EXPECT_TRUE(rates.Take("a", 60).exceeded);
  EXPECT_EQ(rates.Take("a", 60).reset_seconds, 1);
}

TEST(RateLimiter, AClockThatIsSetBackLocksNobodyOut) {
  int64_t now_ms = 3'600'000;
  RateLimiter rates([&] { return now_ms; });
  EXPECT_FALSE(rates.Take("a", 60).exceeded);
  now_ms = 0;
  EXPECT_FALSE(rates.Take("a", 60).exceeded);
  for (int i = 0; i < 70; ++i) rates.Take("a", 60);
  EXPECT_LE(rates.Take("a", 60).reset_seconds, 1);
}

TEST(Access, TokensOfTheProviderCountAndOthersNot) {
  const testing_support::ScratchFolder scratch;
  const TokenSigner provider(scratch.path(), "k1"), stranger(scratch.path() / "other", "k1");
  HttpOptions options;
  options.access.oidc = {.issuer = "https://id.example", .audience = "kinevox", .jwks = provider.jwks_file()};
  RunningServer s(options, false);
  const int64_t now = SystemClockMs() / 1000;
  const Json good{
      {"iss", "https://id.example"},     {"aud", {"other", "kinevox"}}, {"sub", "u1"}, {"exp", now + 60},
      {"scope", "openid kinevox.write"}, {"kinevox_project", "lab"}};
  const auto status = [&](const std::string& token) { return s.http.Get("/v1/jobs", As(token))->status; };
  const auto with = [&](const char* claim, const Json& value) {
    Json changed = good;
    changed[claim] = value;
    return provider.Sign(changed);
  };
  EXPECT_EQ(status(provider.Sign(good)), 200);
  EXPECT_EQ(status(stranger.Sign(good)), 401) << "signed by somebody else under the same key id";
  EXPECT_EQ(status(provider.Sign(good, R"(["b64"])")), 401) << "an extension that nobody here understands";
  EXPECT_EQ(status(with("exp", now - 3600)), 401);
  EXPECT_EQ(status(with("nbf", now + 3600)), 401);
  EXPECT_EQ(status(with("iss", "https://evil.example")), 401);
  EXPECT_EQ(status(with("aud", "other")), 401);
  EXPECT_EQ(status(with("scope", "openid")), 403);
  EXPECT_EQ(status(with("kinevox_project", nullptr)), 403);
  std::string damaged = provider.Sign(good);
  damaged[damaged.find('.') + 5] ^= 1;
  EXPECT_EQ(status(damaged), 401);
  EXPECT_EQ(status(TokenSigner::Unsigned(good)), 401) << "alg none";
  EXPECT_EQ(status(provider.SignedWithPublicKeyAsSecret(good)), 401) << "HS256 with what everybody knows";
  EXPECT_EQ(s.http.Post("/v1/subjects", As(provider.Sign(good)), R"({"region":"knee"})", "application/json")
                ->status,
            201);
}

TEST(OidcVerifier, TakesUpNewKeysButDoesNotAskAllTheTime) {
  const testing_support::ScratchFolder scratch;
  int64_t now_ms = 1'700'000'000'000;
  int fetched = 0;
  std::string published;
  httplib::Server provider;
  provider.Get("/keys", [&](const httplib::Request&, httplib::Response& r) {
    ++fetched;
    r.set_content(published, "application/json");
  });
  const int port = provider.bind_to_any_port("127.0.0.1");
  std::thread serving([&] { provider.listen_after_bind(); });
  const TokenSigner first(scratch.path() / "1", "k1"), second(scratch.path() / "2", "k2");
  OidcVerifier verifier(
      {.issuer = "i", .audience = "a", .jwks = "http://127.0.0.1:" + std::to_string(port) + "/keys"},
      [&] { return now_ms; }, [&] { return now_ms; });
  const Json claims{{"iss", "i"},
                    {"aud", "a"},
                    {"sub", "u"},
                    {"exp", now_ms / 1000 + 3600},
                    {"scope", {"kinevox.read"}},
                    {"kinevox_project", "lab"}};
  published = "{\"keys\":[" + first.public_key() + "]}";
  EXPECT_EQ(verifier.Verify(first.Sign(claims)).who, "oidc:u");
  published = "{\"keys\":[" + first.public_key() + "," + second.public_key() + "]}";
  for (int i = 0; i < 5; ++i) EXPECT_THROW(verifier.Verify(second.Sign(claims)), Unauthorised);
  EXPECT_EQ(fetched, 1) << "unknown keys do not become questions to the provider";
  now_ms += 31'000;
  EXPECT_EQ(verifier.Verify(second.Sign(claims)).project, "lab");
  EXPECT_EQ(fetched, 2);
  provider.stop();
  serving.join();
  EXPECT_THROW(
      OidcVerifier({.issuer = "i", .audience = "a", .jwks = "http://id.example/keys"}, [] { return 0; }),
      InputError);
  EXPECT_THROW(OidcVerifier({.issuer = "i"}, [] { return 0; }), InputError);
}

TEST(Audit, HoldsWhoDidWhatAndNoNames) {
  RunningServer s(WithKeys(), false);
  const std::string key = KeyFor(s, "lab");
  s.http.set_default_headers(As(key));
  const std::string made = s.Post("/v1/subjects", {{"region", "knee"}, {"name", "Jane Roe"}})["id"];
  s.http.Get("/v1/subjects/" + made);
  s.Upload("/v1/subjects/" + made + "/scans?name=JaneRoe&filename=JaneRoe.nii", "VOXELS");
  EXPECT_EQ(s.http.Put("/v1/subjects/" + made + "/scans/Ann_Doe?filename=a.nii", "VOXELS", "x/y")->status,
            201);
  s.http.Get("/v1/jobs", As("kvx.key_x.y"));
  EXPECT_EQ(s.http.Delete("/v1/subjects/" + made)->status, 204);
  EXPECT_EQ(s.world.FilesUnder("blobs"), 0u);
  const auto answer = s.http.Get("/v1/audit?limit=10");
  ASSERT_EQ(answer->status, 200);
  const Json items = Json::parse(answer->body)["items"];
  ASSERT_EQ(items.size(), 5u) << "of this project alone: " << answer->body;
  EXPECT_EQ(items[4]["action"], "POST /v1/subjects");
  EXPECT_EQ(items[4]["object"], made);
  EXPECT_EQ(items[4]["outcome"], "201");
  EXPECT_EQ(items[4]["who"], key.substr(4, key.rfind('.') - 4));
  EXPECT_EQ(items[1]["action"], "subject removed");
  for (const char* name : {"Jane", "Doe"}) EXPECT_EQ(answer->body.find(name), std::string::npos) << name;
  EXPECT_EQ(s.world.audit.Verify().entries, 6) << "the refused one too";
  EXPECT_FALSE(s.world.audit.Verify().broken_at);
}

TEST(Audit, HoldsWhichModelOfWhomIsBuilt) {
  RunningServer s(WithKeys(), false);
  s.http.set_default_headers(As(KeyFor(s, "lab")));
  const Json model = s.Model();
  EXPECT_EQ(s.world.audit.List({}).items.at(0).entry.object, model["job"].get<std::string>() + " " +
                                                                 model["subject"].get<std::string>() + " " +
                                                                 model["id"].get<std::string>());
}

TEST(Origins, OnlyThoseOnTheListMayUseTheService) {
  HttpOptions options;
  options.cors_origins = {"https://viewer.example"};
  RunningServer s(options, false);
  const httplib::Headers viewer{{"Origin", "https://viewer.example"}, {"Sec-Fetch-Site", "cross-site"}};
  const auto allowed = s.http.Get("/v1/jobs", viewer);
  EXPECT_EQ(allowed->status, 200);
  EXPECT_EQ(allowed->get_header_value("Access-Control-Allow-Origin"), "https://viewer.example");
  EXPECT_EQ(allowed->get_header_value("Vary", "", allowed->get_header_value_count("Vary") - 1), "Origin");
  ExpectProblem(s.http.Get("/v1/jobs", {{"Origin", "https://evil.example"}}), 403);
  httplib::Headers preflight = viewer;
  preflight.emplace("Access-Control-Request-Method", "POST");
  const auto asked = s.http.Options("/v1/models", preflight);
  EXPECT_EQ(asked->status, 204);
  for (const char* header : {"Authorization", "traceparent, tracestate"})
    EXPECT_THAT(asked->get_header_value("Access-Control-Allow-Headers"), HasSubstr(header));
  EXPECT_THAT(asked->get_header_value("Access-Control-Allow-Methods"), HasSubstr("OPTIONS")) << "as tus asks";
  RunningServer closed({}, false);
  EXPECT_FALSE(closed.http.Get("/v1/jobs")->has_header("Access-Control-Allow-Origin"));
}

TEST(Origins, ALinkOfAnyPageLeadsToWhatIsOpen) {
  RunningServer s({}, false);
  const auto status = [&](const char* path, const char* mode, const char* destination) {
    const httplib::Headers link{
        {"Sec-Fetch-Site", "cross-site"}, {"Sec-Fetch-Mode", mode}, {"Sec-Fetch-Dest", destination}};
    return s.http.Get(path, link)->status;
  };
  for (const char* path : {"/", "/docs", "/openapi.json", "/healthz"})
    EXPECT_LT(status(path, "navigate", "document"), 400) << path;
  EXPECT_EQ(status("/v1/subjects", "navigate", "document"), 403);
  EXPECT_EQ(status("/docs", "navigate", "iframe"), 403);
  EXPECT_EQ(status("/docs", "no-cors", "image"), 403);
}

TEST(HttpServer, SpeaksTls) {
  const testing_support::ScratchFolder scratch;
  const SelfSigned certificate(scratch.path());
  HttpOptions options = WithKeys();
  options.tls_certificate = certificate.certificate_file();
  options.tls_key = certificate.key_file();
  RunningServer s(options, false);
  httplib::SSLClient https("localhost", s.server.port());
  https.set_ca_cert_path(certificate.certificate_file());
  https.set_hostname_addr_map({{"localhost", "127.0.0.1"}});
  const auto answer = https.Get("/healthz");
  ASSERT_TRUE(answer) << httplib::to_string(answer.error());
  EXPECT_EQ(answer->status, 200);
  EXPECT_TRUE(answer->has_header("Strict-Transport-Security"));
  EXPECT_EQ(https.Get("/v1/jobs", As(KeyFor(s, "lab")))->status, 200);
  EXPECT_FALSE(s.http.Get("/healthz")) << "nothing in the clear on this port";
}

TEST(HttpServer, ListensBeyondLoopbackOnlyWhenItIsSafe) {
  testing_support::ServiceWorld w;
  Metrics metrics;
  const auto listen = [&](HttpOptions options) {
    options.host = "0.0.0.0";
    options.port = 0;
    HttpServer(
        w.services, metrics, [] { return std::string(); }, options);
  };
  EXPECT_THROW(listen({}), InputError);
  EXPECT_THROW(listen(WithKeys()), InputError) << "keys in the clear";
  HttpOptions proxied = WithKeys();
  proxied.behind_proxy = true;
  EXPECT_NO_THROW(listen(proxied));
  HttpOptions no_keys;
  no_keys.behind_proxy = true;
  EXPECT_THROW(listen(no_keys), InputError);
  HttpOptions bad_tls = WithKeys();
  bad_tls.tls_certificate = bad_tls.tls_key = "/nowhere.pem";
  EXPECT_THROW(listen(bad_tls), InputError);
}

}  // namespace
}  // namespace kvx
