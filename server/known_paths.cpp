// Paths are compared part by part; a part in braces stands for any.
#include "server/known_paths.h"

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>
#include <vector>

#include "api/embedded_schema.h"

namespace kvx {
namespace {

struct KnownPath {
  std::vector<std::string> parts;
  std::set<std::string> methods;
};

std::vector<std::string> PartsOf(std::string_view path) {
  std::vector<std::string> parts;
  for (size_t begin = 1; begin <= path.size();) {
    const size_t end = std::min(path.find('/', begin), path.size());
    parts.emplace_back(path.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

std::vector<KnownPath> ReadPaths() {
  std::vector<KnownPath> known;
  const auto document = nlohmann::json::parse(EmbeddedSchema("openapi.json"));
  for (const auto& path : document["paths"].items()) {
    KnownPath one{PartsOf(path.key()), {}};
    for (std::string method : {"get", "head", "post", "put", "patch", "delete", "options"}) {
      if (!path.value().contains(method)) continue;
      std::ranges::transform(method, method.begin(), [](unsigned char c) { return char(std::toupper(c)); });
      one.methods.insert(method);
      if (method == "GET") one.methods.insert("HEAD");  // the library answers it by GET
    }
    known.push_back(std::move(one));
  }
  return known;
}

bool Matches(const std::vector<std::string>& known, const std::vector<std::string>& asked) {
  return std::ranges::equal(known, asked, [](const std::string& part, const std::string& text) {
    return part.starts_with('{') ? !text.empty() : part == text;
  });
}

}  // namespace

std::string MethodsAt(std::string_view path) {
  static const std::vector<KnownPath> known = ReadPaths();
  const std::vector<std::string> asked = PartsOf(path);
  std::string text;
  for (const KnownPath& one : known) {
    if (!Matches(one.parts, asked)) continue;
    for (const std::string& method : one.methods) text += (text.empty() ? "" : ", ") + method;
    return text;
  }
  return text;
}

}  // namespace kvx
