// Bytes on their way in: plain uploads by POST and PUT, and resumable ones by tus 1.0.
#include <ctime>

#include "api/handlers/bones.h"
#include "api/handlers/resumable_uploads.h"
#include "server/http/http_context.h"

namespace kvx {
namespace {

using httplib::ContentReader;
using httplib::Request;
using httplib::Response;

// Feeds `write` from the wire; false when the client broke off, or is too slow to be waited for. What `write`
// throws ends the reading. Throws Unauthorised where the key was revoked meanwhile.
template <class Write>
bool Receive(const Request& request, const ContentReader& reader, HttpContext& context, const Write& write) {
  std::exception_ptr refused;
  BodyPace pace(context.options.slow_body_seconds);
  const bool complete = reader([&](const char* data, size_t size) {
    try {
      if (context.Drained()) throw Unavailable("the service is stopping; send the upload again");
      write(std::span<const char>(data, size));
      context.metrics.upload_bytes += int64_t(size);
      return !pace.TooSlow(size);
    } catch (...) {
      refused = std::current_exception();
      return false;
    }
  });
  if (refused) std::rethrow_exception(refused);
  if (complete) context.access.RequireNotRevoked(request.get_header_value("Authorization"));
  return complete;
}

void ReceiveUpload(Upload upload, const Request& request, const ContentReader& reader, HttpContext& context,
                   Response& response) {
  if (!Receive(request, reader, context, [&](std::span<const char> bytes) { upload.Write(bytes); })) {
    throw InputError("the upload broke off, or came too slowly; send it again");
  }
  SendAnswer(response, upload.Finish());
}

// Of a request whose scan is here already.
void RequireNoFile(const ContentReader& reader) try { ReadBody(reader, 0); } catch (const BodyTooLarge&) {
  throw InputError("a threshold needs no file; post it without a body");
}

// PUT .../scans/{name} and .../bones/{template}: the same bytes again are no conflict.
Upload PutUpload(Services& services, const Request& request, const char* what) {
  Query query = QueryOf(request);
  query.emplace(what, request.path_params.at("part"));
  const std::string& subject = request.path_params.at("id");
  Upload upload = std::string(what) == "name" ? Upload::OfScan(services, subject, query, KeyIn(request))
                                              : Upload::OfBones(services, subject, query, KeyIn(request));
  upload.SameAgainIsFine();
  return upload;
}

void RequireTus(const Request& request, Response& response) {
  response.set_header("Tus-Resumable", kTusVersion);
  if (request.get_header_value("Tus-Resumable") == kTusVersion) return;
  response.set_header("Tus-Version", kTusVersion);
  throw TusVersionNeeded("this address speaks tus 1.0.0; send Tus-Resumable: 1.0.0");
}

void DescribeUpload(const ResumableUpload& upload, Response& response) {
  response.set_header("Upload-Offset", std::to_string(upload.received));
  response.set_header("Upload-Expires", HttpDate(upload.expires_ms));
  response.set_header("Cache-Control", "no-store");
  if (upload.location) response.set_header("Content-Location", *upload.location);
  NameObject(response, upload.subject);
}

ResumableUpload ReceivePart(Services& s, HttpContext& c, const std::string& id, const Request& q,
                            const ContentReader& body) {
  if (q.get_header_value("Content-Type") != "application/offset+octet-stream") {
    throw UnsupportedMedia("the part's Content-Type is application/offset+octet-stream");
  }
  const std::string offset = q.has_header("Upload-Offset") ? q.get_header_value("Upload-Offset") : "0";
  ResumablePart part(s, id, offset, q.get_header_value("Upload-Checksum"));
  if (!Receive(q, body, c, [&](std::span<const char> bytes) { part.Write(bytes); })) {
    part.BrokeOff();
    throw InputError(
        "the part broke off, or came too slowly; ask by HEAD how much came, and go on from there");
  }
  return part.Finish();
}

void Patch(Services& s, HttpContext& c, const Request& q, Response& r, const ContentReader& body) {
  RequireTus(q, r);
  if (!q.has_header("Upload-Offset")) throw InputError("Upload-Offset is missing");
  DescribeUpload(ReceivePart(s, c, q.path_params.at("id"), q, body), r);
  r.status = 204;
}

void Terminate(Services& s, const Request& q, Response& r) {
  RequireTus(q, r);
  s.resumable.Remove(RequireResumableUpload(s, q.path_params.at("id")).id);
  r.status = 204;
}

void Head(Services& s, const Request& q, Response& r) {
  RequireTus(q, r);
  const ResumableUpload upload = RequireResumableUpload(s, q.path_params.at("id"));
  DescribeUpload(upload, r);
  r.set_header("Upload-Length", std::to_string(upload.length));
  if (!upload.metadata.empty()) r.set_header("Upload-Metadata", upload.metadata);
  r.status = 200;
}

void Create(Services& s, HttpContext& c, const Request& q, Response& r, const ContentReader& body) {
  RequireTus(q, r);
  if (q.has_header("Upload-Defer-Length"))
    throw InputError("uploads of unknown length are not taken; send Upload-Length");
  const std::string length = q.get_header_value("Upload-Length"),
                    metadata = q.get_header_value("Upload-Metadata");
  bool made = false;
  const Answer answer =
      s.idempotency.Once(KeyOf("POST /v1/uploads", KeyIn(q), {length + "\n" + metadata}), [&] {
        made = true;
        return Answer{201, "/v1/uploads/" + CreateResumableUpload(s, length, metadata).id, ""};
      });
  r.set_header("Location", answer.location);
  ResumableUpload upload = RequireResumableUpload(s, answer.location.substr(answer.location.rfind('/') + 1));
  if (q.get_header_value("Content-Type") != "application/offset+octet-stream")
    ReadBody(body, 0);
  else if (made)  // the same request again: Upload-Offset says what came of its bytes
    upload = ReceivePart(s, c, upload.id, q, body);
  DescribeUpload(upload, r);
  r.status = 201;
}

// A proxy in between may know GET and POST only.
void Overridden(Services& s, HttpContext& c, const Request& q, Response& r, const ContentReader& body) {
  RequireResumableUpload(s, q.path_params.at("id"));
  const std::string method = q.get_header_value("X-HTTP-Method-Override");
  if (method == "PATCH") return Patch(s, c, q, r, body);
  if (method != "DELETE" && method != "HEAD")
    throw InputError("POST here needs X-HTTP-Method-Override: PATCH, HEAD or DELETE");
  ReadBody(body, 0);
  if (method == "DELETE")
    Terminate(s, q, r);
  else
    Head(s, q, r);
}

void DescribeTus(Services& s, Response& r) {
  r.set_header("Tus-Resumable", kTusVersion);
  r.set_header("Tus-Version", kTusVersion);
  r.set_header("Tus-Extension", kTusExtensions);
  r.set_header("Tus-Checksum-Algorithm", kTusChecksums);
  r.set_header("Tus-Max-Size", std::to_string(s.upload_quota_bytes));
  r.status = 204;
}

void AddResumableRoutes(httplib::Server& http, HttpContext& c) {
  http.Options("/v1/uploads", [&](const Request&, Response& r) { DescribeTus(c.services, r); });
  http.Options("/v1/uploads/:id", [&](const Request&, Response& r) { DescribeTus(c.services, r); });
  http.Post("/v1/uploads", [&](const Request& q, Response& r, const ContentReader& body) {
    Create(ServicesOf(r), c, q, r, body);
  });
  http.Post("/v1/uploads/:id", [&](const Request& q, Response& r, const ContentReader& body) {
    Overridden(ServicesOf(r), c, q, r, body);
  });
  http.Patch("/v1/uploads/:id", [&](const Request& q, Response& r, const ContentReader& body) {
    Patch(ServicesOf(r), c, q, r, body);
  });
  http.Delete("/v1/uploads/:id", [&](const Request& q, Response& r) { Terminate(ServicesOf(r), q, r); });
  http.Get("/v1/uploads/:id", [&](const Request& q, Response& r) {
    if (q.method == "HEAD") return Head(ServicesOf(r), q, r);
    SendJson(r, 200, GetResumableUpload(ServicesOf(r), q.path_params.at("id")));
  });
}

}  // namespace

void AddUploadRoutes(httplib::Server& http, HttpContext& c) {
  http.Post("/v1/subjects/:id/scans", [&](const Request& q, Response& r, const ContentReader& body) {
    ReceiveUpload(Upload::OfScan(ServicesOf(r), q.path_params.at("id"), QueryOf(q), KeyIn(q)), q, body, c, r);
  });
  http.Put("/v1/subjects/:id/scans/:part", [&](const Request& q, Response& r, const ContentReader& body) {
    ReceiveUpload(PutUpload(ServicesOf(r), q, "name"), q, body, c, r);
  });
  http.Post("/v1/subjects/:id/bones", [&](const Request& q, Response& r, const ContentReader& body) {
    if (BonesKindOf(QueryOf(q)) == BonesKind::kThreshold) {
      RequireNoFile(body);
      return SendAnswer(r, CreateThresholdBones(ServicesOf(r), q.path_params.at("id"), QueryOf(q), KeyIn(q)));
    }
    ReceiveUpload(Upload::OfBones(ServicesOf(r), q.path_params.at("id"), QueryOf(q), KeyIn(q)), q, body, c,
                  r);
  });
  http.Put("/v1/subjects/:id/bones/:part", [&](const Request& q, Response& r, const ContentReader& body) {
    ReceiveUpload(PutUpload(ServicesOf(r), q, "template"), q, body, c, r);
  });
  AddResumableRoutes(http, c);
}

}  // namespace kvx
