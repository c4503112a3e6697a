// One line per route. Handlers throw; the server turns that into problem documents.
#include "api/embedded_schema.h"
#include "api/handlers/animations.h"
#include "api/handlers/audit.h"
#include "api/handlers/batches.h"
#include "api/handlers/bones.h"
#include "api/handlers/jobs.h"
#include "api/handlers/models.h"
#include "api/handlers/posed_points.h"
#include "api/handlers/posed_volumes.h"
#include "api/handlers/registration.h"
#include "api/handlers/scans.h"
#include "api/handlers/slices.h"
#include "api/handlers/subjects.h"
#include "api/handlers/surfaces.h"
#include "api/handlers/webhooks.h"
#include "server/http/http_context.h"

namespace kvx {
namespace {

using httplib::ContentReader;
using httplib::Request;
using httplib::Response;

constexpr size_t kJsonBodyBytes = 8 << 20;     // initial poses of many bones and scans
constexpr size_t kPoseBodyBytes = kLargeBody;  // of hundreds of bones; none holds a turn while it is posed
constexpr size_t kPointsBodyBytes = 64 << 20;

std::string Id(const Request& request) { return request.path_params.at("id"); }
std::string PartId(const Request& request) { return request.path_params.at("part"); }

using Stored = FileAnswer (*)(Services&, const std::string&, const std::string&, const Query&,
                              const Conditions&);

// A stored volume, converted in its turn where it is of another format.
void AddStored(httplib::Server& http, const std::string& path, Stored stored) {
  http.Get(path, [stored](const Request& q, Response& r) {
    SendFile(q, r, stored(ServicesOf(r), Id(q), PartId(q), QueryOf(q), ConditionsOf(q)));
  });
}

void AddSubjectRoutes(httplib::Server& http, HttpContext& c) {
  http.Post("/v1/subjects", [&](const Request& q, Response& r, const ContentReader& body) {
    SendAnswer(r, CreateSubject(ServicesOf(r), ReadWhole(c, r, body, kJsonBodyBytes).text, KeyIn(q)));
  });
  http.Get("/v1/subjects",
           [&](const Request& q, Response& r) { SendJson(r, 200, ListSubjects(ServicesOf(r), QueryOf(q))); });
  http.Get("/v1/subjects/:id",
           [&](const Request& q, Response& r) { SendJson(r, 200, GetSubject(ServicesOf(r), Id(q))); });
  http.Delete("/v1/subjects/:id", [&](const Request& q, Response& r) {
    const Identity& identity = IdentityOf(r);
    DeleteSubject(ServicesOf(r), Id(q), identity.who, identity.project);
    r.status = 204;
  });
  http.Get("/v1/subjects/:id/scans", [&](const Request& q, Response& r) {
    SendJson(r, 200, ListScans(ServicesOf(r), Id(q), QueryOf(q)));
  });
  http.Get("/v1/subjects/:id/scans/:part", [&](const Request& q, Response& r) {
    SendJson(r, 200, GetScan(ServicesOf(r), Id(q), PartId(q)));
  });
  http.Get("/v1/subjects/:id/bones", [&](const Request& q, Response& r) {
    SendJson(r, 200, ListBones(ServicesOf(r), Id(q), QueryOf(q)));
  });
  AddStored(http, "/v1/subjects/:id/scans/:part/volume", GetScanVolume);
  AddStored(http, "/v1/subjects/:id/bones/:part/volume", GetBonesVolume);
  http.Get("/v1/subjects/:id/bones/:part", [&](const Request& q, Response& r) {
    SendJson(r, 200, GetBones(ServicesOf(r), Id(q), PartId(q)));
  });
}

void AddModelRoutes(httplib::Server& http, HttpContext& c) {
  http.Post("/v1/models", [&](const Request& q, Response& r, const ContentReader& body) {
    SendAnswer(r, CreateModel(ServicesOf(r), ReadWhole(c, r, body, kJsonBodyBytes).text, KeyIn(q)));
  });
  http.Get("/v1/models",
           [&](const Request& q, Response& r) { SendJson(r, 200, ListModels(ServicesOf(r), QueryOf(q))); });
  http.Get("/v1/models/:id",
           [&](const Request& q, Response& r) { SendJson(r, 200, GetModel(ServicesOf(r), Id(q))); });
  http.Post("/v1/models/:id/animations", [&](const Request& q, Response& r, const ContentReader& body) {
    SendAnswer(r, CreateAnimation(ServicesOf(r), Id(q), QueryOf(q),
                                  ReadWhole(c, r, body, kJsonBodyBytes).text, KeyIn(q)));
  });
  http.Get("/v1/models/:id/animations/:part", [&](const Request& q, Response& r) {
    SendFile(q, r, GetAnimation(ServicesOf(r), Id(q), PartId(q), ConditionsOf(q)));
  });
  http.Post("/v1/models/:id/points", [&](const Request& q, Response& r, const ContentReader& reader) {
    WholeBody body = ReadWhole(c, r, reader, kPointsBodyBytes);
    AskedPoints points =
        ReadPoints(ServicesOf(r), Id(q), QueryOf(q), q.get_header_value("Content-Type"), body.text);
    body.StepAside();
    PosePoints(ServicesOf(r), points);
    body.StepBack();
    const PointsAnswer answer = WritePoints(points, q.get_header_value("Accept"));
    r.status = 200;
    r.set_content(answer.body, answer.content_type);
  });
}

using Product = FileAnswer (*)(Services&, const std::string&, const Query&, const std::string&,
                               const Conditions&);

// A posed file by GET, or by POST with the pose as body.
void AddProduct(httplib::Server& http, const std::string& path, Product product) {
  http.Get(path, [product](const Request& q, Response& r) {
    SendFile(q, r, product(ServicesOf(r), Id(q), QueryOf(q), "", ConditionsOf(q)));
  });
  http.Post(path, [product](const Request& q, Response& r, const ContentReader& reader) {
    const std::string pose = ReadBody(reader, kPoseBodyBytes);
    if (pose.empty()) throw InputError("the body is empty; send a pose file");
    SendFile(q, r, product(ServicesOf(r), Id(q), QueryOf(q), pose, ConditionsOf(q)));
  });
}

void AddJobRoutes(httplib::Server& http, HttpContext& c) {
  http.Get("/v1/jobs",
           [&](const Request& q, Response& r) { SendJson(r, 200, ListJobs(ServicesOf(r), QueryOf(q))); });
  http.Get("/v1/jobs/:id", [&](const Request& q, Response& r) { SendJson(r, 200, WaitForJob(q, r, c)); });
  http.Get("/v1/jobs/:id/events", [&](const Request& q, Response& r) { SendJobEvents(q, r, c, Id(q)); });
  http.Delete("/v1/jobs/:id",
              [&](const Request& q, Response& r) { SendJson(r, 202, CancelJob(ServicesOf(r), Id(q))); });
}

void AddBatchRoutes(httplib::Server& http, HttpContext& c) {
  http.Post("/v1/batches", [&](const Request& q, Response& r, const ContentReader& body) {
    SendAnswer(r, CreateBatch(ServicesOf(r), ReadWhole(c, r, body, 4 * kJsonBodyBytes).text, KeyIn(q)));
  });
  http.Get("/v1/batches",
           [&](const Request& q, Response& r) { SendJson(r, 200, ListBatches(ServicesOf(r), QueryOf(q))); });
  http.Get("/v1/batches/:id",
           [&](const Request& q, Response& r) { SendJson(r, 200, GetBatch(ServicesOf(r), Id(q))); });
  http.Delete("/v1/batches/:id",
              [&](const Request& q, Response& r) { SendJson(r, 202, CancelBatch(ServicesOf(r), Id(q))); });
  http.Post("/v1/webhooks", [&](const Request& q, Response& r, const ContentReader& body) {
    SendAnswer(r, CreateWebhook(ServicesOf(r), ReadWhole(c, r, body, kJsonBodyBytes).text, KeyIn(q)));
  });
  http.Get("/v1/webhooks",
           [&](const Request& q, Response& r) { SendJson(r, 200, ListWebhooks(ServicesOf(r), QueryOf(q))); });
  http.Get("/v1/webhooks/:id",
           [&](const Request& q, Response& r) { SendJson(r, 200, GetWebhook(ServicesOf(r), Id(q))); });
  http.Delete("/v1/webhooks/:id", [&](const Request& q, Response& r) {
    RemoveWebhook(ServicesOf(r), Id(q));
    r.status = 204;
  });
}

void AddOperationRoutes(httplib::Server& http, HttpContext& c) {
  http.Get("/v1/audit",
           [&](const Request& q, Response& r) { SendJson(r, 200, ListAudit(ServicesOf(r), QueryOf(q))); });
  http.Get("/healthz", [](const Request&, Response& r) { SendJson(r, 200, R"({"status":"ok"})"); });
  http.Get("/readyz", [&](const Request&, Response& r) {
    if (const std::string wrong = c.ready(); !wrong.empty()) throw Unavailable(wrong);
    SendJson(r, 200, R"({"status":"ready"})");
  });
  http.Get("/metrics", [&](const Request&, Response& r) {
    c.job_watch.Look();
    c.metrics.event_streams = c.streams.Taken();
    r.status = 200;
    r.set_content(PrometheusText(c.metrics, c.services), "text/plain; version=0.0.4; charset=utf-8");
  });
  AddApiPage(http);
  http.Get("/openapi.json", [](const Request&, Response& r) {
    SendJson(r, 200, std::string(EmbeddedSchema("openapi.json")));
  });
}

}  // namespace

void AddRoutes(httplib::Server& http, HttpContext& context) {
  AddSubjectRoutes(http, context);
  AddModelRoutes(http, context);
  AddProduct(http, "/v1/models/:id/volume", GetVolume);
  AddProduct(http, "/v1/models/:id/field", GetField);
  AddProduct(http, "/v1/models/:id/slice", GetSlice);
  AddProduct(http, "/v1/models/:id/surface", GetSurface);
  http.Get("/v1/models/:id/registration", [](const Request& q, Response& r) {
    SendFile(q, r, GetRegistration(ServicesOf(r), Id(q), QueryOf(q), ConditionsOf(q)));
  });
  AddUploadRoutes(http, context);
  AddJobRoutes(http, context);
  AddBatchRoutes(http, context);
  AddOperationRoutes(http, context);
}

}  // namespace kvx
