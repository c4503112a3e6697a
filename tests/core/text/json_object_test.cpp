// Documents of strangers are refused in words, never quoted, and never too deep.
#include "core/text/json_object.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace kvx {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

nlohmann::json Parse(const std::string& text) { return ParseObject<nlohmann::json>(text, "the pose"); }

std::string Nested(size_t depth) {  // the object around it is one more
  return "{\"a\":" + std::string(depth - 1, '[') + std::string(depth - 1, ']') + "}";
}

TEST(JsonObject, IsWhatTheTextSays) { EXPECT_EQ(Parse(R"({"a": [1, {"b": null}]})")["a"][0], 1); }

TEST(JsonObject, OtherTextsAreRefusedByNameAndPlace) {
  EXPECT_THAT([] { Parse(""); }, ThrowsMessage<InputError>(HasSubstr("the pose is empty")));
  EXPECT_THAT([] { Parse("[1]"); }, ThrowsMessage<InputError>(HasSubstr("the pose must hold one")));
  EXPECT_THAT([] { Parse("{\"Roe\": }"); },
              ThrowsMessage<InputError>("the pose is not valid JSON (at byte 9)"));
  EXPECT_THAT([] { Parse("{\"Roe\": 1e999}"); }, ThrowsMessage<InputError>("the pose is not valid JSON"));
  for (const std::string& text : {std::string("{\"a\": \"Jos\xe9\"}"), std::string("\xff\xfe{\0\"\0", 6)})
    EXPECT_THAT([&] { Parse(text); }, ThrowsMessage<InputError>(HasSubstr("; save it in UTF-8")));
}

TEST(JsonObject, HoldsEveryKeyOnce) {
  EXPECT_NO_THROW(Parse(R"({"a": {"a": 1, "b": {"a": 2}}, "b": [{"a": 3}, {"a": 4}]})"));
  for (const char* text : {R"({"a": 1, "a": 1})", R"({"c": [{"b": {}, "a": {"b": 1}, "a": 2}]})"})
    EXPECT_THAT([&] { Parse(text); }, ThrowsMessage<InputError>(HasSubstr("key 'a' twice"))) << text;
  EXPECT_THAT([] { Parse(R"({"Jane Roe": 1, "Jane Roe": 1})"); },
              ThrowsMessage<InputError>(testing::Not(HasSubstr("Roe"))));
}

TEST(JsonObject, GoesNoDeeperThanCopiesCanFollow) {
  EXPECT_NO_THROW(Parse(Nested(kDeepestJson)));
  for (const size_t depth : {size_t(kDeepestJson) + 1, size_t(2'000'000)})
    EXPECT_THAT([&] { Parse(Nested(depth)); }, ThrowsMessage<InputError>(HasSubstr("deeper than 64")));
  std::string objects;
  for (int i = 0; i < 200'000; ++i) objects += "{\"a\":";
  EXPECT_THAT([&] { Parse(objects); }, ThrowsMessage<InputError>(HasSubstr("deeper than 64")));
}

}  // namespace
}  // namespace kvx
