// Checks answers against the service's own document (openapi.json):
// every status, media type and body must be described, and every header that a client goes by.
#pragma once
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace kvx::testing_support {

struct AnswerSeen {
  std::string method, path;  // without the query
  int status = 0;
  std::string content_type, body;
  std::vector<std::string> headers = {};  // their names
};

class ApiContract {
 public:
  explicit ApiContract(std::string_view openapi_json);
  ~ApiContract();
  std::string Violation(const AnswerSeen& answer) const;  // empty when the answer is as described
  // Empty when a JSON body is as the document describes it for POST at one of its paths.
  std::string RequestViolation(const std::string& path, const std::string& body) const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kvx::testing_support
