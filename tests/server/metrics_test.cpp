// What Prometheus reads.
#include "server/metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace kvx {
namespace {

using testing::HasSubstr;

TEST(Histograms, ASumGrowsByWhatIsAddedHoweverLargeItIs) {
  Histograms histograms;
  histograms.Observe("a=\"b\"", 12'345'678);
  EXPECT_THAT(histograms.Text("s", ""), HasSubstr("s_sum{a=\"b\"} 12345678\n"));
  histograms.Observe("a=\"b\"", 0.0625);
  const std::string text = histograms.Text("s", "");
  EXPECT_THAT(text, HasSubstr("s_sum{a=\"b\"} 12345678.0625\n"));
  EXPECT_THAT(text, HasSubstr("s_count{a=\"b\"} 2\n"));
  EXPECT_THAT(text, HasSubstr("s_bucket{a=\"b\",le=\"0.0025\"} 0\n")) << "bounds as people write them";
  EXPECT_THAT(text, HasSubstr("s_bucket{a=\"b\",le=\"0.1\"} 1\n"));
}

}  // namespace
}  // namespace kvx
