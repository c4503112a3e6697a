// Checked once, at the door.
#include "api/request.h"

#include <algorithm>
#include <ctime>
#include <nlohmann/json.hpp>

#include "core/errors.h"
#include "core/name.h"
#include "core/text/json_object.h"
#include "core/text/parse_number.h"

namespace kvx {

std::string QueryValue(const Query& query, const std::string& name, const std::string& otherwise) {
  const auto [first, last] = query.equal_range(name);
  if (first == last) return otherwise;
  if (std::next(first) != last) throw InputError("the parameter '" + name + "' is given more than once");
  return first->second;
}

namespace {
// For messages: what a client sent is repeated only where it cannot break a line or a log.
std::string Printable(std::string_view text) {
  std::string out(text.substr(0, 64));
  for (char& c : out) {
    if (c < ' ' || c > '~') c = '?';
  }
  return out;
}
}  // namespace

void RequireKnown(const Query& query, std::initializer_list<std::string_view> known) {
  for (const auto& [name, value] : query) {
    if (std::ranges::find(known, name) == known.end()) {
      throw InputError("there is no parameter '" + Printable(name) + "' here");
    }
    RequireGiven(name, value);
  }
}

void RequireGiven(const std::string& name, const std::string& value) {
  if (!value.empty()) return;
  throw InputError("the parameter '" + Printable(name) + "' is empty; give it a value or leave it out");
}

std::string FormatAmong(const Query& query, std::initializer_list<std::string_view> formats,
                        const std::string& what) {
  std::string format = QueryValue(query, "format", std::string(*formats.begin()));
  if (std::ranges::find(formats, format) != formats.end()) return format;
  std::string all;
  for (const std::string_view& known : formats)
    all += (all.empty() ? "" : &known == formats.end() - 1 ? " or " : ", ") + std::string(known);
  throw InputError("'format' of " + what + " is " + all);
}

int QueryInt(const Query& query, const std::string& name, int otherwise, int least, int most) {
  const std::string text = QueryValue(query, name);
  if (text.empty()) return otherwise;
  const auto value = ParseAs<int>(text);
  if (!value || *value < least || *value > most) {
    throw InputError("'" + name + "' is a whole number from " + std::to_string(least) + " to " +
                     std::to_string(most));
  }
  return *value;
}

double ParseNumber(std::string_view text, const std::string& what) {
  if (const auto value = ParseFinite(text)) return *value;
  throw InputError(Printable(what) + " is not a number");
}

std::string CursorOf(int64_t before) { return "c" + std::to_string(before); }

std::optional<std::string> QueryText(const Query& query, const std::string& name) {
  if (!query.contains(name)) return std::nullopt;
  return QueryValue(query, name);
}

PageRequest ParsePage(const Query& query, std::string_view filter) {
  RequireKnown(query, {"cursor", "limit", filter});
  PageRequest page;
  page.limit = QueryInt(query, "limit", page.limit, 1, 200);
  const std::string cursor = QueryValue(query, "cursor");
  if (cursor.empty()) return page;
  const auto before = ParseAs<int64_t>(std::string_view(cursor).substr(1));
  if (cursor[0] != 'c' || !before || *before <= 0)
    throw InputError("'cursor' is the 'next' of the page before");
  page.before = *before;
  return page;
}

void RequireFewValues(std::string_view json, const JsonLimits& limits) {
  size_t commas = 0, lists = 0, keys = 0;
  for (const char c : json) {
    commas += c == ',';
    lists += c == '[' || c == '{';
    keys += c == ':';
  }
  if (commas + lists <= limits.values && lists <= limits.lists && keys <= limits.keys) return;
  throw InputError("the body holds more values than one request may; send it in parts");
}

Json ParseBody(std::string_view body, const JsonLimits& limits) {
  RequireFewValues(body, limits);
  return ParseObject<Json>(body, "the body");
}

void RequireFields(const Json& object, std::initializer_list<std::string_view> known,
                   const std::string& where) {
  for (const auto& item : object.items()) {
    if (std::ranges::find(known, item.key()) == known.end()) {
      throw InputError("there is no field '" + Printable(item.key()) + "' in " + where);
    }
  }
}

std::string Dump(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

void RequireName(const std::string& name, const std::string& what) {
  if (IsName(name) && name[0] != '.') return;
  throw InputError(what + " has 1 to 64 letters, digits, '.', '_' or '-', and does not start with '.'");
}

std::string IsoTime(int64_t utc_ms) {
  const std::time_t seconds = std::time_t(utc_ms / 1000);
  std::tm utc{};
  gmtime_r(&seconds, &utc);
  char text[32], millis[8];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &utc);
  std::snprintf(millis, sizeof millis, ".%03dZ", int(utc_ms % 1000));
  return std::string(text) + millis;
}

RequestKey KeyOf(const std::string& scope, const std::string& key,
                 std::initializer_list<std::string_view> request) {
  if (key.size() > 255) throw InputError("an Idempotency-Key has at most 255 characters");
  Hasher digest;
  digest.Add(scope);
  for (const std::string_view part : request) digest.Add(part);
  return {scope, key, digest.Finish()};
}

}  // namespace kvx
