// Hosts and ports that every reader takes for the same, and those that readers take for different ones.
#include "core/text/authority.h"

#include <gtest/gtest.h>

#include <string>

namespace kvx {
namespace {

TEST(Authority, IsAHostWithOrWithoutAPort) {
  for (const char* text : {"a", "idp.example", "IDP-2.example:8443", "a_b.local", "127.0.0.1", "127.0.0.1:1",
                           "a:65535", "[::1]", "[fe80::2]:8080", "2130706433"})
    EXPECT_TRUE(IsAuthority(text)) << text;
}

TEST(Authority, IsNothingThatReadersSplitInTwoWays) {
  for (const char* text : {"",
                           ":80",
                           "127.0.0.2#.evil.example",
                           "127.0.0.1\\.evil.example",
                           "user@a",
                           "user:word@a",
                           "a/b",
                           "a?b",
                           "a:",
                           "a:0",
                           "a:65536",
                           "a:99999999999",
                           "a:+80",
                           "a:80:90",
                           "a: 80",
                           "a b",
                           "a%00b",
                           "a%2eb",
                           "a;b",
                           "a,b",
                           "a[::1]",
                           "[::1",
                           "[]",
                           "[::1]80",
                           "[::1]a:80",
                           "[::ffff:127.0.0.1]",
                           "[fe80::1%25eth0]",
                           "[a]",
                           "::1",
                           "\xc3\xa4.example"})
    EXPECT_FALSE(IsAuthority(text)) << text;
  EXPECT_FALSE(IsAuthority(std::string(254, 'a')));
  EXPECT_FALSE(IsAuthority(std::string_view("a\0b", 3)));
}

}  // namespace
}  // namespace kvx
