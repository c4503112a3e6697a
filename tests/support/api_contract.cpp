// JSON bodies are validated by valijson against the document's schemas.
#include "tests/support/api_contract.h"

#include <algorithm>
#include <iterator>
#include <nlohmann/json.hpp>
#include <sstream>
#include <valijson/adapters/nlohmann_json_adapter.hpp>
#include <valijson/schema.hpp>
#include <valijson/schema_parser.hpp>
#include <valijson/validation_results.hpp>
#include <valijson/validator.hpp>
#include <vector>

namespace kvx::testing_support {
namespace {

using nlohmann::json;
using Adapter = valijson::adapters::NlohmannJsonAdapter;

std::vector<std::string> Segments(const std::string& path) {
  std::vector<std::string> parts;
  std::istringstream text(path);
  for (std::string part; std::getline(text, part, '/');) parts.push_back(part);
  return parts;
}

bool Matches(const std::string& pattern, const std::string& path) {
  const auto wanted = Segments(pattern), given = Segments(path);
  if (wanted.size() != given.size()) return false;
  for (size_t i = 0; i < wanted.size(); ++i) {
    if (!wanted[i].starts_with('{') && wanted[i] != given[i]) return false;
  }
  return true;
}

// Not those that every answer may have, which say nothing of what was asked for.
bool GoesBy(const std::string& header) {
  constexpr std::string_view kOthers[] = {
      "Location",    "Content-Location", "ETag", "Content-Disposition", "Content-Range",
      "Retry-After", "WWW-Authenticate", "Allow"};
  return header.starts_with("X-Kinevox-") || header.starts_with("Upload-") ||
         std::ranges::find(kOthers, header) != std::end(kOthers);
}

std::string HeaderViolation(const json& response, const AnswerSeen& answer) {
  const json described = response.value("headers", json::object());
  for (const std::string& header : answer.headers)
    if (GoesBy(header) && !described.contains(header)) return "the header " + header + " is not described";
  return "";
}

std::string MediaType(const std::string& content_type) {
  return content_type.substr(0, content_type.find(';'));
}

// Null where none of the parts of an object's schema has it.
const json* SchemaOfField(const std::vector<const json*>& parts, const std::string& name) {
  for (const json* part : parts) {
    if (part->contains("properties") && part->at("properties").contains(name))
      return &part->at("properties").at(name);
  }
  for (const json* part : parts) {
    if (part->contains("additionalProperties")) return &part->at("additionalProperties");
  }
  return nullptr;
}

}  // namespace

struct ApiContract::State {
  json document;

  const json* PathOf(const std::string& path) const {
    const json* found = nullptr;
    for (const auto& item : document["paths"].items()) {
      if (item.key() == path) return &item.value();
      if (Matches(item.key(), path)) found = &item.value();
    }
    return found;
  }
  const json& Resolved(const json& node) const {
    if (!node.contains("$ref")) return node;
    return document.at(json::json_pointer(node["$ref"].get<std::string>().substr(1)));
  }
  std::string BodyViolation(const json& schema, const std::string& text) const;
  std::vector<const json*> Parts(const json& schema) const;
  std::string Undescribed(const json& schema, const json& value) const;
  std::string ContentViolation(const json& response, const AnswerSeen& answer) const;
};

// References are looked up from the root of what the parser is given, so the document's schemas go with it.
std::string ApiContract::State::BodyViolation(const json& schema, const std::string& text) const {
  const json body = json::parse(text, nullptr, false);
  if (body.is_discarded()) return "the body is not JSON";
  const json whole{{"allOf", json::array({schema})}, {"components", document["components"]}};
  valijson::Schema compiled;
  valijson::SchemaParser().populateSchema(Adapter(whole), compiled);
  valijson::ValidationResults results;
  if (valijson::Validator().validate(compiled, Adapter(body), &results)) return "";
  std::string sentence = "the body is not as described:";
  for (valijson::ValidationResults::Error error; results.popError(error);)
    sentence += " " + error.description;
  return sentence + " " + text.substr(0, 500);
}

// The schema with all that it refers to or chooses from, whichever of them hold.
std::vector<const json*> ApiContract::State::Parts(const json& schema) const {
  std::vector<const json*> parts{&Resolved(schema)};
  const json& whole = *parts[0];
  for (const char* joined : {"allOf", "anyOf", "oneOf"}) {
    if (!whole.contains(joined)) continue;
    for (const json& one : whole.at(joined)) {
      const std::vector<const json*> more = Parts(one);
      parts.insert(parts.end(), more.begin(), more.end());
    }
  }
  return parts;
}

// The first field that no schema has, with those around it; empty without any. A client that is made from the
// document cannot read it.
std::string ApiContract::State::Undescribed(const json& schema, const json& value) const {
  if (schema == true) return "";
  const std::vector<const json*> parts = Parts(schema);
  if (value.is_array()) {
    for (const json* part : parts) {
      for (size_t i = 0; part->contains("items") && i < value.size(); ++i) {
        if (std::string inner = Undescribed(part->at("items"), value[i]); !inner.empty()) return inner;
      }
    }
  }
  if (!value.is_object()) return "";
  for (const auto& field : value.items()) {
    const json* description = SchemaOfField(parts, field.key());
    if (!description) return field.key();
    if (const std::string inner = Undescribed(*description, field.value()); !inner.empty())
      return field.key() + "." + inner;
  }
  return "";
}

std::string ApiContract::State::ContentViolation(const json& response, const AnswerSeen& answer) const {
  const bool described = response.contains("content");
  if (answer.body.empty()) return "";  // HEAD, 204, 304
  if (!described) return "there is a body where none is described";
  const auto media = response["content"].find(MediaType(answer.content_type));
  if (media == response["content"].end())
    return "the media type " + answer.content_type + " is not described";
  if (MediaType(answer.content_type).find("json") == std::string::npos || !media->contains("schema"))
    return "";
  if (const std::string wrong = BodyViolation((*media)["schema"], answer.body); !wrong.empty()) return wrong;
  const std::string field = Undescribed((*media)["schema"], json::parse(answer.body));
  return field.empty() ? "" : "the field " + field + " is not described";
}

ApiContract::ApiContract(std::string_view openapi_json) : state_(new State{json::parse(openapi_json)}) {}
ApiContract::~ApiContract() = default;

std::string ApiContract::RequestViolation(const std::string& path, const std::string& body) const {
  const json& post = state_->document.at("paths").at(path).at("post");
  return state_->BodyViolation(post.at("/requestBody/content/application~1json/schema"_json_pointer), body);
}

std::string ApiContract::Violation(const AnswerSeen& answer) const {
  const json* path = state_->PathOf(answer.path);
  std::string method = answer.method;
  for (char& c : method) c = char(std::tolower(static_cast<unsigned char>(c)));
  if (method == "head" && path && !path->contains("head")) method = "get";
  if (!path || !path->contains(method)) {
    const json& problem = state_->document["components"]["responses"]["Problem"];
    if (answer.status >= 400) return state_->ContentViolation(problem, answer);
    return answer.status == 204 ? "" : answer.method + " " + answer.path + " is not in the document";
  }
  const json& responses = (*path)[method]["responses"];
  const std::string status = std::to_string(answer.status);
  if (!responses.contains(status) && (answer.status < 400 || !responses.contains("default"))) {
    return answer.method + " " + answer.path + " answered " + status + ", which is not described";
  }
  const json& response =
      state_->Resolved(responses.contains(status) ? responses[status] : responses["default"]);
  std::string violation = state_->ContentViolation(response, answer);
  if (violation.empty()) violation = HeaderViolation(response, answer);
  return violation.empty() ? "" : answer.method + " " + answer.path + " " + status + ": " + violation;
}

}  // namespace kvx::testing_support
