// The page at /docs.
#include <gmock/gmock.h>

#include "tests/support/running_server.h"

namespace kvx {
namespace {

using testing_support::RunningServer;

TEST(ApiPage, IsWhatTheBareAddressLeadsTo) {
  RunningServer s;
  const auto root = s.http.Get("/");
  EXPECT_EQ(root->status, 302);
  EXPECT_EQ(root->get_header_value("Location"), "/docs");
  EXPECT_EQ(s.http.Get("/docs")->status, 200);
}

TEST(ApiPage, FitsATelephoneAndAsksForNothingThatIsNotThere) {
  RunningServer s;
  const auto page = s.http.Get("/docs");
  EXPECT_THAT(page->body, testing::HasSubstr("rel=\"icon\"")) << "or browsers ask for one";
  EXPECT_THAT(page->get_header_value("Content-Security-Policy"),
              testing::HasSubstr("img-src 'self' data: blob:"))
      << "it shows a slice that was asked for";
  EXPECT_THAT(page->body, testing::HasSubstr("<a href=\"/openapi.json\">"))
      << "without JavaScript it is blank";
  const auto narrow = s.http.Get("/docs/narrow.css");
  EXPECT_EQ(narrow->get_header_value("Content-Type"), "text/css; charset=utf-8");
  EXPECT_THAT(narrow->body, testing::HasSubstr("max-width: 640px"));
}

}  // namespace
}  // namespace kvx
