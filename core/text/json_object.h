// JSON that strangers wrote. The library parses any depth, but copies and prints by recursion: a few
// hundred kilobytes of brackets would use up a thread's stack.
#pragma once
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "core/errors.h"
#include "core/name.h"

namespace kvx {

constexpr int kDeepestJson = 64;  // objects and lists in each other

// Of two values of one key the library would keep the later, without a word.
template <class Json>
class UniqueKeys {
 public:
  using Event = typename Json::parse_event_t;
  // `parsed`: the key, of key events. False for one that its object has already.
  bool Take(Event event, const Json& parsed) {
    if (event == Event::object_start) of_open_objects_.emplace_back();
    if (event == Event::object_end) of_open_objects_.pop_back();
    return event != Event::key || of_open_objects_.back().insert(parsed.template get<std::string>()).second;
  }

 private:
  std::vector<std::set<std::string>> of_open_objects_;
};

// "'key'" for messages, if the key is a word as our names are.
inline std::string QuotedWord(const std::string& key) {
  const bool word = key.size() <= kLongestName && AreNameCharacters(key);
  return word ? "'" + key + "'" : "that is no word";
}

// `what` names the document in errors: "the study file". Throws InputError when the text is not one JSON
// object, goes deeper than kDeepestJson or has a key twice in one object; no message quotes more than a key.
template <class Json>
Json ParseObject(std::string_view text, const std::string& what) {
  using Event = typename Json::parse_event_t;
  UniqueKeys<Json> keys;
  const auto checked = [&](int around, Event event, Json& parsed) {
    const bool starts = event == Event::object_start || event == Event::array_start;
    if (starts && around >= kDeepestJson)
      throw InputError(what + " has lists in lists, or objects in objects, deeper than " +
                       std::to_string(kDeepestJson));
    if (!keys.Take(event, parsed))
      throw InputError(what + " has a key " + QuotedWord(parsed.template get<std::string>()) +
                       " twice in one object; leave one of them");
    return true;
  };
  if (text.empty()) throw InputError(what + " is empty; it must hold one JSON object");
  try {
    Json document = Json::parse(text, checked);
    if (document.is_object()) return document;
  } catch (const typename Json::parse_error& error) {  // its text quotes the document
    const bool other_coding = text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff") ||
                              std::string_view(error.what()).find("UTF-8") != std::string_view::npos;
    throw InputError(what + " is not valid JSON (at byte " + std::to_string(error.byte) + ")" +
                     (other_coding ? "; save it in UTF-8" : ""));
  } catch (const typename Json::exception&) {
    throw InputError(what + " is not valid JSON");
  }
  throw InputError(what + " must hold one JSON object");
}

}  // namespace kvx
