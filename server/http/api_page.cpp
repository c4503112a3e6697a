// /docs, where / leads: Swagger UI over /openapi.json, embedded at build time; nothing comes from elsewhere.
#include "server/http/http_context.h"

namespace kvx {

// Generated at build; empty for other names.
std::string_view EmbeddedPage(std::string_view file_name);     // of server/page
std::string_view EmbeddedApiPage(std::string_view file_name);  // Swagger UI's; empty where npm was missing

namespace {

// Swagger UI sets styles on its elements, has pictures of its own as data: and those of answers as blob:.
constexpr char kPolicy[] =
    "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data: blob:; "
    "connect-src 'self'; "
    "frame-ancestors 'none'";

void SendPart(httplib::Response& response, std::string_view content, const char* type) {
  if (content.empty()) throw NotFound("this build has no such part of the API page");
  response.set_header("Content-Security-Policy", kPolicy);
  response.status = 200;
  response.set_content(std::string(content), type);
}

}  // namespace

void AddApiPage(httplib::Server& http) {
  http.Get("/", [](const httplib::Request&, httplib::Response& r) { r.set_redirect("/docs"); });
  http.Get("/docs", [](const httplib::Request&, httplib::Response& r) {
    const bool built = !EmbeddedApiPage("swagger-ui-bundle.js").empty();
    SendPart(r, EmbeddedPage(built ? "docs.html" : "not_built.html"), "text/html; charset=utf-8");
  });
  http.Get("/docs/:file", [](const httplib::Request& q, httplib::Response& r) {
    const std::string file = q.path_params.at("file");
    const bool style = file.ends_with(".css");
    const std::string_view ours = style || file.ends_with(".js") ? EmbeddedPage(file) : "";
    SendPart(r, ours.empty() ? EmbeddedApiPage(file) : ours,
             style ? "text/css; charset=utf-8" : "text/javascript; charset=utf-8");
  });
}

}  // namespace kvx
