// Requests made from what the API's document says of an operation: examples and what is required.
#pragma once
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <vector>

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

// Adds "name=value" to a query; of an object its own names and values.
inline void AddParameter(std::string& query, const std::string& name, const Json& value) {
  if (value.is_object()) {
    for (const auto& item : value.items()) AddParameter(query, item.key(), item.value());
    return;
  }
  query += (query.empty() ? "?" : "&") + name + "=" +
           (value.is_string() ? value.get<std::string>() : value.dump());
}

// "?name=..." of the parameters that an operation of the document asks for, by their examples. Without one, a
// scan that the tests' models have.
inline std::string RequiredQuery(const Json& operation) {
  std::string query;
  for (const Json& parameter : operation.value("parameters", Json::array())) {
    if (parameter.value("in", "") != "query" || !parameter.value("required", false)) continue;
    AddParameter(query, parameter["name"], parameter.value("example", Json("pose01")));
  }
  return query;
}

// What a page made from the document proposes: the examples and defaults of all parameters, and what is
// required.
inline std::string ProposedQuery(const Json& operation) {
  std::string query;
  for (const Json& parameter : operation.value("parameters", Json::array())) {
    if (parameter.value("in", "") != "query") continue;
    const std::string name = parameter["name"];
    if (parameter.contains("example"))
      AddParameter(query, name, parameter["example"]);
    else if (parameter["schema"].contains("default"))
      AddParameter(query, name, parameter["schema"]["default"]);
    else if (parameter.value("required", false))
      AddParameter(query, name, "pose01");
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

// All of them; one of bytes where the document has none.
inline std::vector<ExampledBody> ExampleBodies(const Json& operation,
                                               const std::map<std::string, std::string>& ids) {
  std::vector<ExampledBody> bodies;
  const Json content = operation.value("/requestBody/content"_json_pointer, Json::object());
  for (const auto& media : content.items()) {
    const Json examples = media.value().value("examples", Json::object());
    for (const auto& example : examples.items()) {
      const Json& value = example.value()["value"];
      bodies.push_back(
          {Filled(value.is_string() ? value.get<std::string>() : value.dump(), ids), media.key()});
    }
  }
  if (bodies.empty()) bodies.emplace_back();
  return bodies;
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
