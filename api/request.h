// The parts of a request that handlers read: query parameters, pages, JSON bodies.
// Everything unknown is refused by name.
#pragma once
#include <initializer_list>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>

#include "core/digest.h"
#include "storage/idempotency.h"
#include "storage/page.h"

namespace kvx {

using Json = nlohmann::ordered_json;
using Query = std::multimap<std::string, std::string>;

// A small answer in JSON.
using Answer = KeptAnswer;

std::string QueryValue(const Query& query, const std::string& name,
                       const std::string& otherwise = "");  // at most once
// Throws InputError naming what is not known, or is empty: a variable that was not set must not fall back.
void RequireKnown(const Query& query, std::initializer_list<std::string_view> known);
void RequireGiven(const std::string& name, const std::string& value);  // throws InputError for an empty one
// `format`, the first of these where it is left out; `what` has it, in refusals.
std::string FormatAmong(const Query& query, std::initializer_list<std::string_view> formats,
                        const std::string& what);
int QueryInt(const Query& query, const std::string& name, int otherwise, int least, int most);
double ParseNumber(std::string_view text, const std::string& what);  // finite; throws InputError

std::optional<std::string> QueryText(const Query& query, const std::string& name);  // nothing: left out
// cursor, limit; refuses other parameters but the one that the list is searched by.
PageRequest ParsePage(const Query& query, std::string_view filter = "limit");
std::string CursorOf(int64_t before);

// How much one document may hold: each value takes memory, however few bytes it has.
struct JsonLimits {
  size_t values = 4'000'000;  // all of them
  size_t lists = 500'000;     // lists and objects among them
  size_t keys = 500'000;
};
// Counts before anything is made of the text; punctuation in texts counts too. Throws InputError.
void RequireFewValues(std::string_view json, const JsonLimits& limits = {});
Json ParseBody(std::string_view body, const JsonLimits& limits = {});  // one JSON object; throws InputError
void RequireFields(const Json& object, std::initializer_list<std::string_view> known,
                   const std::string& where);
std::string Dump(const Json& json);

// Throws InputError unless it is a name (core/name.h), and as a file's one not hidden.
void RequireName(const std::string& name, const std::string& what);
std::string IsoTime(int64_t utc_ms);

// `scope` is method and path; whatever else shapes the answer is in `request`: a query in its own words, a
// body or its digest.
RequestKey KeyOf(const std::string& scope, const std::string& idempotency_key,
                 std::initializer_list<std::string_view> request);

}  // namespace kvx
