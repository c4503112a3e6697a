// Requests made from what the API's document says of an operation: examples and what is required.
#pragma once
#include <map>
#include <nlohmann/json.hpp>
#include <optional>

#include "api/request.h"
#include "server/http_library.h"

namespace kvx::testing_support {

// Puts real ids where the document's examples and paths name a kind of thing.
inline std::string Filled(std::string text, const std::map<std::string, std::string>& ids) {
  for (const auto& [name, id] : ids) {
    const std::string slot = "{" + name + "}";
    for (size_t at; (at = text.find(slot)) != text.npos;) text.replace(at, slot.size(), id);
  }
  return text;
}

// "?name=..." of the parameters that an operation of the document asks for, by their examples.
inline std::string RequiredQuery(const Json& operation) {
  std::string query;
  for (const Json& parameter : operation.value("parameters", Json::array())) {
    if (parameter.value("in", "") != "query" || !parameter.value("required", false)) continue;
    const Json example = parameter.contains("example") ? parameter["example"] : Json("x");
    query += (query.empty() ? "?" : "&") + parameter["name"].get<std::string>() + "=" +
             (example.is_string() ? example.get<std::string>() : example.dump());
  }
  return query;
}

struct ExampledBody {
  std::string text = "VOXELSd", type = "application/octet-stream";
};

inline httplib::Headers RequiredHeaders(const Json& operation) {
  httplib::Headers headers;
  for (const Json& parameter : operation.value("parameters", Json::array())) {
    if (parameter.value("in", "") != "header" || !parameter.value("required", false)) continue;
    const Json& schema = parameter["schema"];
    const Json value = schema.contains("const") ? schema["const"] : parameter.value("example", Json("0"));
    headers.emplace(parameter["name"].get<std::string>(),
                    value.is_string() ? value.get<std::string>() : value.dump());
  }
  return headers;
}

inline ExampledBody ExampleBody(const Json& operation, const std::map<std::string, std::string>& ids) {
  ExampledBody body;
  if (!operation.contains("requestBody")) return body;
  for (const auto& media : operation["requestBody"]["content"].items()) {
    body.type = media.key();
    if (!media.value().contains("examples")) continue;
    const Json& value = media.value()["examples"].begin().value()["value"];
    return {Filled(value.is_string() ? value.get<std::string>() : value.dump(), ids), media.key()};
  }
  return body;
}

// Nothing for what is not an operation.
inline std::optional<httplib::Result> Send(httplib::Client& http, const std::string& method,
                                           const std::string& address, const ExampledBody& body,
                                           const httplib::Headers& headers) {
  if (method == "get") return http.Get(address, headers);
  if (method == "head") return http.Head(address, headers);
  if (method == "delete") return http.Delete(address, headers);
  if (method == "post") return http.Post(address, headers, body.text, body.type);
  if (method == "put") return http.Put(address, headers, body.text, body.type);
  if (method == "patch") return http.Patch(address, headers, body.text, body.type);
  return std::nullopt;
}

}  // namespace kvx::testing_support
