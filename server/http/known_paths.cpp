// Paths are compared part by part; a part in braces stands for any.
#include "server/http/known_paths.h"

#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>
#include <ranges>
#include <vector>

#include "api/embedded_schema.h"
#include "core/text/listed.h"

namespace kvx {
namespace {

struct KnownPath {
  std::vector<std::string> parts;
  std::map<std::string, bool> methods;  // and whether any query parameter is theirs
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

bool TakesParameters(const nlohmann::json& operation) {
  const auto parameters = operation.find("parameters");
  return parameters != operation.end() &&
         std::ranges::any_of(*parameters, [](const auto& one) { return one.value("in", "") == "query"; });
}

std::vector<KnownPath> ReadPaths() {
  std::vector<KnownPath> known;
  const auto document = nlohmann::json::parse(EmbeddedSchema("openapi.json"));
  for (const auto& path : document["paths"].items()) {
    KnownPath one{PartsOf(path.key()), {}};
    for (std::string method : {"get", "head", "post", "put", "patch", "delete", "options"}) {
      if (!path.value().contains(method)) continue;
      const bool takes = TakesParameters(path.value()[method]);
      std::ranges::transform(method, method.begin(), [](unsigned char c) { return char(std::toupper(c)); });
      one.methods[method] = takes;
      if (method == "GET") one.methods["HEAD"] = takes;  // the library answers it by GET
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

// Null where there is nothing.
const KnownPath* PathAt(std::string_view path) {
  static const std::vector<KnownPath> known = ReadPaths();
  const std::vector<std::string> asked = PartsOf(path);
  const auto found =
      std::ranges::find_if(known, [&](const KnownPath& one) { return Matches(one.parts, asked); });
  return found == known.end() ? nullptr : &*found;
}

}  // namespace

std::string MethodsAt(std::string_view path) {
  const KnownPath* known = PathAt(path);
  return known ? Listed(std::views::keys(known->methods)) : "";
}

bool TakesNoParameters(std::string_view method, std::string_view path) {
  const KnownPath* known = PathAt(path);
  if (!known) return false;
  const auto found = known->methods.find(std::string(method));
  return found != known->methods.end() && !found->second;
}

}  // namespace kvx
