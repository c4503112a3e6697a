// JSON bodies are validated by valijson against the document's schemas.
#include "tests/support/api_contract.h"

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

std::string MediaType(const std::string& content_type) {
  return content_type.substr(0, content_type.find(';'));
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

std::string ApiContract::State::ContentViolation(const json& response, const AnswerSeen& answer) const {
  const bool described = response.contains("content");
  if (answer.body.empty()) return "";  // HEAD, 204, 304
  if (!described) return "there is a body where none is described";
  const auto media = response["content"].find(MediaType(answer.content_type));
  if (media == response["content"].end())
    return "the media type " + answer.content_type + " is not described";
  if (MediaType(answer.content_type).find("json") == std::string::npos || !media->contains("schema"))
    return "";
  return BodyViolation((*media)["schema"], answer.body);
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
  const std::string violation = state_->ContentViolation(response, answer);
  return violation.empty() ? "" : answer.method + " " + answer.path + " " + status + ": " + violation;
}

}  // namespace kvx::testing_support
