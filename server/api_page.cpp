// /docs, where / leads: Swagger UI over /openapi.json, embedded at build time; nothing comes from elsewhere.
#include "server/http_context.h"

namespace kvx {

std::string_view EmbeddedApiPage(
    std::string_view file_name);  // generated at build; empty where npm was missing

namespace {

constexpr char kPage[] = R"(<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Kinevox API</title>
<link rel="icon" href="data:,">
<link rel="stylesheet" href="/docs/swagger-ui.css">
<link rel="stylesheet" href="/docs/narrow.css">
</head>
<body>
<div id="page"></div>
<script src="/docs/swagger-ui-bundle.js"></script>
<script src="/docs/start.js"></script>
</body>
</html>
)";
constexpr char kStart[] =
    "SwaggerUIBundle({url: '/openapi.json', dom_id: '#page', deepLinking: true, validatorUrl: null});\n";
// A telephone has no room for the column of links, of which the document has none.
constexpr char kNarrow[] = R"(@media (max-width: 640px) {
  .swagger-ui .response-col_links { display: none; }
}
)";
constexpr char kNoPage[] = R"(<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<title>Kinevox API</title>
<link rel="icon" href="data:,">
</head>
<body>
<p>This build has no API page: npm was missing when it was set up. The description of the API is at
<a href="/openapi.json">/openapi.json</a>; to have the page, install npm, run ./do setup and build again.</p>
</body>
</html>
)";
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
    SendPart(r, EmbeddedApiPage("swagger-ui-bundle.js").empty() ? kNoPage : kPage,
             "text/html; charset=utf-8");
  });
  http.Get("/docs/:file", [](const httplib::Request& q, httplib::Response& r) {
    const std::string file = q.path_params.at("file");
    if (file == "start.js") return SendPart(r, kStart, "text/javascript; charset=utf-8");
    if (file == "narrow.css") return SendPart(r, kNarrow, "text/css; charset=utf-8");
    SendPart(r, EmbeddedApiPage(file),
             file.ends_with(".css") ? "text/css; charset=utf-8" : "text/javascript; charset=utf-8");
  });
}

}  // namespace kvx
