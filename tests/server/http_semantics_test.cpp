// What the standards of HTTP say of a request's parts, over real sockets.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/support/raw_connection.h"
#include "tests/support/running_server.h"

namespace kvx {
namespace {

using testing::HasSubstr;
using testing::StartsWith;
using testing_support::ExpectProblem;
using testing_support::RawConnection;
using testing_support::RunningServer;

TEST(HttpSemantics, AKeyThatIsEmptyIsNoKey) {
  RunningServer s;
  const httplib::Headers empty{{"Idempotency-Key", ""}};
  const auto made = s.http.Post("/v1/subjects", empty, R"({"region":"knee"})", "application/json");
  ExpectProblem(made, 400);
  EXPECT_THAT(made->body, HasSubstr("Idempotency-Key is empty"));
  EXPECT_EQ(s.http.Get("/v1/subjects", empty)->status, 200);
}

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
TEST(HttpSemantics, TwoHostsAreRefusedWhicheverComesFirst) {
  RunningServer s({}, false);
  for (const auto& [first, second] :
       {std::pair{"127.0.0.1", "evil.example"}, {"evil.example", "127.0.0.1"}, {"127.0.0.1", "127.0.0.1"}}) {
    ExpectProblem(s.http.Get("/healthz", {{"Host", first}, {"Host", second}}), 400);
  }
}

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
  for (const char* nameless : {"/volume?=5", "/volume?level=2&=", "/slice?=1&mm=3"}) {
    RawConnection connection(s.server.port());  // the client leaves them out
    connection.Send("GET " + model + nameless + " HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n");
    const std::string answer = connection.Answer();
    EXPECT_THAT(answer, StartsWith("HTTP/1.1 400")) << nameless;
    EXPECT_THAT(answer, HasSubstr("no name")) << nameless;
  }
}

TEST(HttpSemantics, ARangeIsForGetAlone) {
  RunningServer s;
  const std::string path = "/v1/models/" + s.BuiltModel() + "/volume?format=nrrd";
  const httplib::Headers first_ten{{"Range", "bytes=0-9"}};
  const auto part = s.http.Get(path, first_ten);
  EXPECT_EQ(part->status, 206);
  EXPECT_EQ(part->body.size(), 10u);
  const auto head = s.http.Head(path, first_ten);
  EXPECT_EQ(head->status, 200);
  EXPECT_FALSE(head->has_header("Content-Range"));
  EXPECT_EQ(head->get_header_value("Content-Length"), std::to_string(s.http.Get(path)->body.size()));
}

// An answer that says what was made must not turn into 416 afterwards.
TEST(HttpSemantics, ARangeOfWhatHasNoneIsIgnored) {
  RunningServer s;
  const httplib::Headers beyond{{"Range", "bytes=999999-"}}, first_four{{"Range", "bytes=0-3"}};
  const auto made = s.http.Post("/v1/subjects", beyond, R"({"region":"knee"})", "application/json");
  EXPECT_EQ(made->status, 201) << made->body;
  for (const char* path : {"/v1/subjects", "/healthz", "/metrics", "/openapi.json", "/docs"}) {
    const auto part = s.http.Get(path, first_four);
    EXPECT_EQ(part->status, 200) << path;
    EXPECT_GT(part->body.size(), 4u) << path;
    EXPECT_EQ(s.http.Get(path, beyond)->status, 200) << path;
  }
  const std::string volume = "/v1/models/" + s.BuiltModel() + "/volume?format=nrrd";
  const auto posted =
      s.http.Post(volume, first_four, R"({"joints":{"tibia.flexion":35}})", "application/json");
  EXPECT_EQ(posted->status, 206) << "a pose too long for a query has the same file";
}

TEST(HttpSemantics, AnswersWithoutABodyTellNoLength) {
  RunningServer s;
  const std::string path = "/v1/models/" + s.BuiltModel() + "/volume?format=nrrd";
  const std::string etag = s.http.Get(path)->get_header_value("ETag");
  const auto fresh = s.http.Get(path, httplib::Headers{{"If-None-Match", "W/" + etag}});
  EXPECT_EQ(fresh->status, 304) << "the weak comparison";
  EXPECT_FALSE(fresh->has_header("Content-Length"));
  const auto options = s.http.Options("/v1/uploads");
  EXPECT_EQ(options->status, 204);
  EXPECT_FALSE(options->has_header("Content-Length"));
}

TEST(HttpSemantics, IfMatchComparesStrongly) {
  RunningServer s;
  const std::string path = "/v1/models/" + s.BuiltModel() + "/volume?format=nrrd";
  const std::string etag = s.http.Get(path)->get_header_value("ETag");
  ExpectProblem(s.http.Get(path, httplib::Headers{{"If-Match", "W/" + etag}}), 412);
  for (const std::string& same : {etag, "W/" + etag + ", " + etag, std::string("*")})
    EXPECT_EQ(s.http.Get(path, httplib::Headers{{"If-Match", same}})->status, 200) << same;
}

TEST(HttpSemantics, AHeaderThatIsNotUnderstoodIsNamed) {
  RunningServer s;
  const auto expect_named = [&](const char* header, const char* value, int status) {
    const auto result = s.http.Get("/v1/models", httplib::Headers{{header, value}});
    ExpectProblem(result, status);
    EXPECT_THAT(result->body, testing::HasSubstr(std::string("the ") + header + " header")) << value;
    EXPECT_EQ(result->get_header_value("traceparent").size(), 55u);
  };
  for (const char* accept : {"application/json,", "garbage", "a/b;q=2"}) expect_named("Accept", accept, 400);
  expect_named("Range", "lines=1-2", 416);
}

TEST(HttpSemantics, HeadersThatAreTooLongAreNamed) {
  RunningServer s({}, false);
  const std::string begin = "GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\n";
  std::string many;
  for (int i = 0; i < 101; ++i) many += "X-A: b\r\n";
  for (const std::string& headers : {"X-A: " + std::string(9000, 'a') + "\r\n", many}) {
    RawConnection connection(s.server.port());
    connection.Send(begin + headers + "\r\n");
    const std::string answer = connection.Answer();
    EXPECT_THAT(answer, StartsWith("HTTP/1.1 400"));
    EXPECT_THAT(answer, HasSubstr("8 KiB"));
  }
}

TEST(HttpSemantics, AMethodThatNobodyTakesIsToldWhichAreTaken) {
  RunningServer s({}, false);
  for (const std::string method : {"TRACE", "PROPFIND", "BREW"}) {
    RawConnection connection(s.server.port());
    connection.Send(method + " /v1/subjects?limit=1 HTTP/1.1\r\nHost: 127.0.0.1\r\n\r\n");
    const std::string answer = connection.Answer();
    EXPECT_THAT(answer, StartsWith("HTTP/1.1 405")) << method;
    EXPECT_THAT(answer, HasSubstr("Allow: GET, HEAD, POST\r\n")) << method;
    EXPECT_THAT(answer, HasSubstr("application/problem+json")) << method;
  }
  RawConnection connection(s.server.port());
  connection.Send("no request\r\n\r\n");
  EXPECT_THAT(connection.Answer(), StartsWith("HTTP/1.1 400"));
}

// The library waits for a body of DELETE and POST, and would take the next request for it.
TEST(HttpSemantics, ARequestThatTellsNoLengthHasNoBody) {
  RunningServer s({}, false);
  const std::string job = s.Model()["job"], host = " HTTP/1.1\r\nHost: 127.0.0.1\r\n";
  RawConnection connection(s.server.port());
  connection.Send("DELETE /v1/jobs/" + job + host + "\r\n");
  EXPECT_THAT(connection.Answer(), StartsWith("HTTP/1.1 202"));
  connection.Send("GET /healthz" + host + "\r\n");
  EXPECT_THAT(connection.Answer(), HasSubstr(R"({"status":"ok"})"));
  connection.Send("POST /v1/subjects" + host + "\r\n");
  EXPECT_THAT(connection.Answer(), StartsWith("HTTP/1.1 400")) << "no JSON";
}

TEST(HttpSemantics, ATargetMayBeAWholeAddressWhoseHostCounts) {
  RunningServer s({}, false);
  const auto answer = [&](const std::string& target, const std::string& host) {
    RawConnection connection(s.server.port());
    connection.Send("GET " + target + " HTTP/1.1\r\nHost: " + host + "\r\n\r\n");
    return connection.Answer();
  };
  EXPECT_THAT(answer("http://127.0.0.1/healthz", "127.0.0.1"), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(answer("http://localhost:8080/v1/subjects?limit=1", "evil.example"),
              StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(answer("http://evil.example/healthz", "127.0.0.1"), StartsWith("HTTP/1.1 421"));
  EXPECT_THAT(answer("http://127.0.0.1", "127.0.0.1"), StartsWith("HTTP/1.1 302"))
      << "/ leads to the API's page";
}

TEST(HttpSemantics, AConnectionThatIsToBeClosedIsClosed) {
  RunningServer s({}, false);
  RawConnection connection(s.server.port());
  connection.Send("DELETE /v1/jobs/" + s.Model()["job"].get<std::string>() +
                  " HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n");
  EXPECT_THAT(connection.Answer(), StartsWith("HTTP/1.1 202"));
  EXPECT_TRUE(connection.Closed());
}

// RFC 9112, 9.3.2.
TEST(HttpSemantics, RequestsSentAtOnceAreAnsweredInTheirOrder) {
  RunningServer s;
  RawConnection connection(s.server.port());
  const std::string host = " HTTP/1.1\r\nHost: 127.0.0.1\r\n";
  const std::string body = R"({"region":"knee"})";
  connection.Send("GET /healthz" + host + "\r\nPOST /v1/subjects" + host +
                  "Content-Type: application/json\r\nContent-Length: " + std::to_string(body.size()) +
                  "\r\n\r\n" + body + "GET /v1/nowhere" + host + "\r\n");
  EXPECT_THAT(connection.Answer(), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(connection.Answer(), StartsWith("HTTP/1.1 201"));
  EXPECT_THAT(connection.Answer(), StartsWith("HTTP/1.1 404"));
}

// Bytes of a body that came with the request before it were taken for requests.
TEST(HttpSemantics, NoPartOfABodyIsARequest) {
  RunningServer s;
  const std::string subject = s.Post("/v1/subjects", {{"region", "knee"}})["id"];
  const std::string host = " HTTP/1.1\r\nHost: 127.0.0.1\r\n";
  const std::string within = "DELETE /v1/subjects/" + subject + host + "\r\n";
  const std::string first = "GET /healthz" + host + "\r\n";
  std::string upload = "POST /v1/subjects/" + subject + "/scans?name=a&filename=a.nii" + host +
                       "Content-Type: application/octet-stream\r\nContent-Length: 5000\r\n\r\n";
  constexpr size_t kReadAtOnce = 4096;  // the library's
  upload += "VOXELS" + std::string(kReadAtOnce - first.size() - upload.size() - 6, '.');
  const size_t sent_of_body = upload.size() - upload.find("\r\n\r\n") - 4;
  upload += within + std::string(5000 - sent_of_body - within.size(), '.');
  RawConnection connection(s.server.port());
  connection.Send(first + upload);
  EXPECT_THAT(connection.Answer(), StartsWith("HTTP/1.1 200"));
  EXPECT_THAT(connection.Answer(), StartsWith("HTTP/1.1 201"));
  EXPECT_EQ(s.http.Get("/v1/subjects/" + subject)->status, 200);
}

TEST(HttpSemantics, TheWishToCloseIsHeardHoweverItIsWritten) {
  RunningServer s({}, false);
  for (const char* wish : {"close", "Close", "TE, close", "close,TE"}) {
    RawConnection connection(s.server.port());
    connection.Send(std::string("GET /healthz HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: ") + wish +
                    "\r\n\r\n");
    EXPECT_THAT(connection.Answer(), HasSubstr("\r\nConnection: close\r\n")) << wish;
    EXPECT_TRUE(connection.Closed()) << wish;
  }
}

TEST(HttpSemantics, IdentityIsNoCoding) {
  RunningServer s;
  for (const char* coding : {"identity", "Identity"}) {
    const auto made = s.http.Post("/v1/subjects", {{"Content-Encoding", coding}}, R"({"region":"knee"})",
                                  "application/json");
    EXPECT_EQ(made->status, 201) << coding << made->body;
  }
  ExpectProblem(
      s.http.Post("/v1/subjects", {{"Content-Encoding", "gzip"}}, R"({"region":"knee"})", "application/json"),
      415);
}

TEST(HttpSemantics, NamesOfLoopbackAreTheSameWhateverTheirCase) {
  RunningServer s({}, false);
  for (const char* host : {"LOCALHOST", "Localhost:8080", "localhost.", "localhost.:8080"})
    EXPECT_EQ(s.http.Get("/healthz", {{"Host", host}})->status, 200) << host;
  for (const char* host : {"localhost..", "localhost.evil.example"})
    EXPECT_EQ(s.http.Get("/healthz", {{"Host", host}})->status, 421) << host;
}

TEST(HttpSemantics, EveryAnswerTellsItsDate) {
  RunningServer s({}, false);
  for (const char* path : {"/healthz", "/v1/nowhere"}) {
    const std::string date = s.http.Get(path)->get_header_value("Date");
    EXPECT_THAT(date, testing::MatchesRegex("..., [0-9]+ ... [0-9]+ [0-9]+:[0-9]+:[0-9]+ GMT")) << path;
  }
}

// Nobody is asked to send what nobody will read.
TEST(HttpSemantics, ABodyThatNoAddressTakesIsNotAskedFor) {
  RunningServer s({}, false);
  for (const auto& [line, status] : {std::pair{"POST /v1/nope", "404"}, {"PUT /v1/jobs", "405"}}) {
    RawConnection connection(s.server.port());
    connection.Send(
        std::string(line) +
        " HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: 900000000\r\nExpect: 100-continue\r\n\r\n");
    EXPECT_THAT(connection.Answer(), StartsWith(std::string("HTTP/1.1 ") + status)) << line;
  }
}

TEST(HttpSemantics, HeadPromisesNoRangesOfWhatHasNone) {
  RunningServer s;
  EXPECT_EQ(s.http.Head("/v1/subjects")->get_header_value("Accept-Ranges"), "");
}

}  // namespace
}  // namespace kvx
