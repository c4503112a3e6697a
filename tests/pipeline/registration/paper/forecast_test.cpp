// Forecasts that can be written down: blocks, seconds, and which limit comes first.
#include "pipeline/registration/paper/forecast.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

PaperForecast Forecast(const PaperOptions& options, const std::vector<PaperPace>& levels) {
  return ForecastOf(options, levels);
}

TEST(PaperForecasts, WithoutALimitTheRestTakesAsLongABlockAsWhatIsDone) {
  const PaperForecast forecast = Forecast({}, {{10, 20.0, 30}});
  EXPECT_EQ(forecast.text, "10 of about 40 blocks, about 60 s left");
  EXPECT_DOUBLE_EQ(forecast.fraction, 0.25);
}

TEST(PaperForecasts, HoursAreSaidInMinutesAndTheFirstBlocksTellNoTime) {
  EXPECT_EQ(Forecast({}, {{3, 30.0, 720}}).text, "3 of about 723 blocks, about 120 min left");
  EXPECT_EQ(Forecast({}, {{2, 30.0, 720}}).text, "2 of about 722 blocks");
}

TEST(PaperForecasts, ALimitInBlocksCounts) {
  PaperOptions options;
  options.max_blocks = 12;
  EXPECT_EQ(Forecast(options, {{10, 20.0, 30}}).text, "10 of about 12 blocks, about 4 s left");
}

TEST(PaperForecasts, ALimitInSecondsSaysHowManyBlocksItLeavesRoomFor) {
  PaperOptions options;
  options.max_seconds = 30;
  const PaperForecast forecast = Forecast(options, {{10, 20.0, 1000}});
  EXPECT_EQ(forecast.text, "10 of about 15 blocks, about 10 s left");
  EXPECT_DOUBLE_EQ(forecast.fraction, 2.0 / 3);
}

TEST(PaperForecasts, WhatTookLongerThanItsLimitHasNothingLeft) {
  PaperOptions options;
  options.max_seconds = 20;
  const PaperForecast forecast = Forecast(options, {{21, 21.4, 545}});
  EXPECT_EQ(forecast.text, "21 of about 21 blocks, about 0 s left");
  EXPECT_DOUBLE_EQ(forecast.fraction, 1.0);
}

// Of four coarse blocks each took 3 s, and a finer one costs a third: 6 x 3 + 90 x 1 = 108 s are left.
TEST(PaperForecasts, FinerLevelsTakeWhatTheirBlocksCost) {
  const PaperForecast forecast = Forecast({}, {{4, 12.0, 6, 0.9}, {0, 0.0, 90, 0.3}});
  EXPECT_EQ(forecast.text, "4 of about 100 blocks, about 108 s left");
  EXPECT_DOUBLE_EQ(forecast.fraction, 12.0 / 120) << "of the time";
}

TEST(PaperForecasts, ALevelsOwnBlocksTellBetterThanTheirCost) {
  const std::vector<PaperPace> levels{{10, 30.0, 0, 0.9}, {5, 25.0, 10, 0.3}};
  EXPECT_EQ(Forecast({}, levels).text, "15 of about 25 blocks, about 50 s left");
}

TEST(PaperForecasts, ALimitMayEndTheRunWithinAFinerLevel) {
  const std::vector<PaperPace> levels{{4, 12.0, 6, 0.9}, {0, 0.0, 90, 0.3}};
  PaperOptions blocks, seconds;
  blocks.max_blocks = 20;
  EXPECT_EQ(Forecast(blocks, levels).text, "4 of about 20 blocks, about 28 s left");
  seconds.max_seconds = 50;
  EXPECT_EQ(Forecast(seconds, levels).text, "4 of about 30 blocks, about 38 s left");
}

}  // namespace
}  // namespace kvx
