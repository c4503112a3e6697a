// What the routes of one server share, and the answers they give. Inside server/ only: HTTP library types.
#pragma once
#include <atomic>

#include "api/errors.h"
#include "api/handlers/posing.h"
#include "server/http_library.h"
#include "server/http_server.h"

namespace kvx {

struct HttpContext {
  Services& services;
  Metrics& metrics;
  ReadyCheck ready;
  HttpOptions options;
  std::atomic<bool> stopping{false};
};

void AddRoutes(httplib::Server& http, HttpContext& context);
void AddUploadRoutes(httplib::Server& http, HttpContext& context);

// Answers.
void SendJson(httplib::Response& response, int status, std::string body);
void SendAnswer(httplib::Response& response, const Answer& answer);
void SendProblem(httplib::Response& response, const Problem& problem);
void SendFile(const httplib::Request& request, httplib::Response& response, const FileAnswer& answer);
// GET /v1/jobs/{j}?wait=SECONDS&after=EVENT: answers once something has happened after the event, or the time is up.
std::string WaitForJob(HttpContext& context, const httplib::Request& request);
void SendJobEvents(const httplib::Request& request, httplib::Response& response, HttpContext& context,
                   const std::string& job);

// Requests.
Query QueryOf(const httplib::Request& request);
Conditions ConditionsOf(const httplib::Request& request);  // refers to the request
std::string ReadBody(const httplib::ContentReader& reader, size_t limit_bytes);  // throws BodyTooLarge
// Empty, or the problem of a request that no handler may see: broken header values, encoded or multipart bodies, foreign
// hosts and origins (a page in a browser must not reach a service that asks for no token).
std::optional<Problem> Refusal(const httplib::Request& request);

}  // namespace kvx
