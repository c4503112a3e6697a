// What comes in a query, a list's cursor and a name: taken as documented or refused in words.
#include "api/request.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "core/errors.h"

namespace kvx {
namespace {

TEST(Query, AParameterThatIsGivenTwiceIsRefused) {
  const Query query{{"format", "nii"}, {"format", "raw"}, {"level", "1"}};
  EXPECT_THROW(QueryValue(query, "format"), InputError);
  EXPECT_EQ(QueryValue(query, "level"), "1");
  EXPECT_EQ(QueryValue(query, "label", "false"), "false");
}

TEST(Page, ACursorIsOneThatTheServiceGave) {
  EXPECT_EQ(ParsePage({{"cursor", CursorOf(7)}}).before, 7);
  for (const char* cursor : {"c0", "c-1", "c", "7", "x7", "c7x", "c 7"}) {
    EXPECT_THROW(ParsePage({{"cursor", cursor}}), InputError) << cursor;
  }
}

TEST(Page, HasOneToTwoHundredItems) {
  for (const char* limit : {"0", "201", "-1", "1.5"})
    EXPECT_THROW(ParsePage({{"limit", limit}}), InputError) << limit;
  EXPECT_EQ(ParsePage({{"limit", "1"}}).limit, 1);
  EXPECT_EQ(ParsePage({{"limit", "200"}}).limit, 200);
}

// A few bytes of text each, but a hundred in memory: counted before anything is made of them.
TEST(Body, OfMoreValuesThanOneRequestMayHoldIsRefused) {
  const auto many = [](const std::string& begin, const std::string& each, size_t count) {
    std::string text = begin;
    for (size_t i = 0; i < count; ++i) text += each;
    return text;  // not valid: whoever parsed it would say so
  };
  const auto refusal = [](const std::string& text) -> std::string {
    try {
      ParseBody(text);
    } catch (const InputError& e) {
      return e.what();
    }
    return "";
  };
  EXPECT_THAT(refusal(many("{\"models\":[", "[],", 500'001)), testing::HasSubstr("more values"));
  EXPECT_THAT(refusal(many("{\"models\":[", "0,", 4'000'000)), testing::HasSubstr("more values"));
  EXPECT_THAT(refusal(many("{", "\"\":0,", 500'001)), testing::HasSubstr("more values"));
  EXPECT_THAT(refusal(many("{\"models\":[", "[],", 1000)), testing::HasSubstr("valid JSON"));
}

TEST(Format, IsOneOfThoseThatThereAre) {
  const auto among = [](const Query& query) {
    return FormatAmong(query, {"nii.gz", "nrrd", "mha"}, "a thing");
  };
  EXPECT_EQ(among({}), "nii.gz");
  EXPECT_EQ(among({{"format", "mha"}}), "mha");
  EXPECT_THAT(
      [&] {
        among({{"format", "raw"}});
      },
      testing::ThrowsMessage<InputError>("'format' of a thing is nii.gz, nrrd or mha"));
}

TEST(Name, DoesNotBeginWithADotNorLeaveItsFolder) {
  for (const std::string& name : {std::string(".hidden"), std::string(".."), std::string(),
                                  std::string("a/b"), std::string("a b"), std::string(65, 'a')}) {
    EXPECT_THROW(RequireName(name, "'name'"), InputError) << name;
  }
  for (const std::string& name : {std::string("a.b_C-9"), std::string("_"), std::string(64, 'a')})
    EXPECT_NO_THROW(RequireName(name, "'name'")) << name;
}

}  // namespace
}  // namespace kvx
