// What is a number and what only begins like one.
#include "core/text/parse_number.h"

#include <gtest/gtest.h>

#include <cstdint>

namespace kvx {
namespace {

TEST(ParseNumber, TakesTheWholeTextOrNothing) {
  EXPECT_EQ(ParseAs<int>("12"), 12);
  EXPECT_EQ(ParseAs<int>("-3"), -3);
  EXPECT_EQ(ParseAs<int64_t>("9007199254740993"), 9007199254740993);
  for (const char* text : {"", "12 ", " 12", "+12", "1.5", "12mm", "0x10", "99999999999999999999"})
    EXPECT_EQ(ParseAs<int>(text), std::nullopt) << text;
}

TEST(ParseNumber, FiniteOnesMayHaveASign) {
  EXPECT_EQ(ParseFinite("35"), 35.0);
  EXPECT_EQ(ParseFinite("+2.5"), 2.5);
  EXPECT_EQ(ParseFinite("-1e-3"), -1e-3);
  for (const char* text :
       {"", "+", "+-5", "++5", "2,5", "35 ", "nan", "inf", "-inf", "1e999", "0x10", "5deg"})
    EXPECT_EQ(ParseFinite(text), std::nullopt) << text;
}

}  // namespace
}  // namespace kvx
