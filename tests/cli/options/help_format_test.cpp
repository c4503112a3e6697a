// Lines of help texts: broken between words, examples left alone.
#include "cli/options/help_format.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

TEST(HelpFormat, BreaksLongLinesBetweenWords) {
  EXPECT_EQ(Wrapped("one two three four", 9), "one two\nthree\nfour");
  EXPECT_EQ(Wrapped("one two three four", 18), "one two three four");
  EXPECT_EQ(Wrapped("a word-that-is-too-long b", 5), "a\nword-that-is-too-long\nb");
  EXPECT_EQ(Wrapped("", 5), "");
}

TEST(HelpFormat, KeepsParagraphsAndExamples) {
  EXPECT_EQ(Wrapped("one two\n\nExamples:\n  kinevox --with many words", 7),
            "one two\n\nExamples:\n  kinevox --with many words");
}

}  // namespace
}  // namespace kvx
