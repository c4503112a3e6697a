// JSON that strangers wrote. The library parses any depth, but copies and prints by recursion: a few
// hundred kilobytes of brackets would use up a thread's stack.
#pragma once
#include <nlohmann/json.hpp>
#include <string>
#include <string_view>

#include "core/errors.h"

namespace kvx {

constexpr int kDeepestJson = 64;  // objects and lists in each other

// `what` names the document in errors: "the study file". Throws InputError when the text is not one JSON
// object, or goes deeper than kDeepestJson; no message quotes it.
template <class Json>
Json ParseObject(std::string_view text, const std::string& what) {
  using Event = typename Json::parse_event_t;
  const auto not_too_deep = [&](int around, Event event, Json&) {
    const bool starts = event == Event::object_start || event == Event::array_start;
    if (starts && around >= kDeepestJson)
      throw InputError(what + " has lists in lists, or objects in objects, deeper than " +
                       std::to_string(kDeepestJson));
    return true;
  };
  try {
    Json document = Json::parse(text, not_too_deep);
    if (document.is_object()) return document;
  } catch (const typename Json::parse_error& error) {  // its text quotes the document
    throw InputError(what + " is not valid JSON (at byte " + std::to_string(error.byte) + ")");
  } catch (const typename Json::exception&) {
    throw InputError(what + " is not valid JSON");
  }
  throw InputError(what + " must hold one JSON object");
}

}  // namespace kvx
