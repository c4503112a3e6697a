// Addresses as people write them.
#include "server/address.h"

#include <gtest/gtest.h>

#include "core/errors.h"

namespace kvx {
namespace {

TEST(SplitUrl, KnowsOriginHostAndPath) {
  const UrlParts plain = SplitUrl("https://idp.example:8443/keys?v=1");
  EXPECT_EQ(plain.origin, "https://idp.example:8443");
  EXPECT_EQ(plain.host, "idp.example");
  EXPECT_EQ(plain.path, "/keys?v=1");
  EXPECT_EQ(SplitUrl("http://idp.example").path, "/");
  EXPECT_EQ(SplitUrl("http://idp.example?a=1").path, "/?a=1");
}

TEST(SplitUrl, KnowsIpv6) {
  const UrlParts parts = SplitUrl("http://[::1]:8080/v1");
  EXPECT_EQ(parts.origin, "http://[::1]:8080");
  EXPECT_EQ(parts.host, "::1");
  EXPECT_EQ(parts.path, "/v1");
  EXPECT_EQ(SplitUrl("http://[fe80::2]").host, "fe80::2");
}

TEST(SplitUrl, RefusesWhatHasNoHost) {
  for (const char* url : {"", "localhost:8080", "http://", "http:///path", "/v1/jobs"})
    EXPECT_THROW(SplitUrl(url), InputError) << url;
}

// The library connects to 127.0.0.2 there.
TEST(SplitUrl, RefusesHostsThatOthersReadAsAnother) {
  for (const char* url : {"http://127.0.0.2#.evil.example/p", "http://user@127.0.0.2/", "http://a:80:90/",
                          "http://[::1]evil.example/"})
    EXPECT_THROW(SplitUrl(url), InputError) << url;
}

TEST(IsLoopback, IsThisMachineOnly) {
  for (const char* host : {"127.0.0.1", "127.9.9.9", "::1", "localhost"})
    EXPECT_TRUE(IsLoopback(host)) << host;
  for (const char* host : {"0.0.0.0", "::", "192.168.1.2", "example.org", "127.0.0.1.example.org"})
    EXPECT_FALSE(IsLoopback(host)) << host;
}

}  // namespace
}  // namespace kvx
