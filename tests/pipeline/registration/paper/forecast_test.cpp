// Forecasts that can be written down: blocks, seconds, and which limit comes first.
#include "pipeline/registration/paper/forecast.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

TEST(Forecast, WithoutALimitTheRestTakesAsLongABlockAsWhatIsDone) {
  const PaperForecast forecast = ForecastOf({}, {10, 20.0}, 30);
  EXPECT_EQ(forecast.text, "10 of about 40 blocks, about 60 s left");
  EXPECT_DOUBLE_EQ(forecast.fraction, 0.25);
}

TEST(Forecast, HoursAreSaidInMinutesAndTheFirstBlocksTellNoTime) {
  EXPECT_EQ(ForecastOf({}, {3, 30.0}, 720).text, "3 of about 723 blocks, about 120 min left");
  EXPECT_EQ(ForecastOf({}, {2, 30.0}, 720).text, "2 of about 722 blocks");
}

TEST(Forecast, ALimitInBlocksCounts) {
  PaperOptions options;
  options.max_blocks = 12;
  EXPECT_EQ(ForecastOf(options, {10, 20.0}, 30).text, "10 of about 12 blocks, about 4 s left");
}

TEST(Forecast, ALimitInSecondsSaysHowManyBlocksItLeavesRoomFor) {
  PaperOptions options;
  options.max_seconds = 30;
  const PaperForecast forecast = ForecastOf(options, {10, 20.0}, 1000);
  EXPECT_EQ(forecast.text, "10 of about 15 blocks, about 10 s left");
  EXPECT_DOUBLE_EQ(forecast.fraction, 2.0 / 3);
}

TEST(Forecast, WhatTookLongerThanItsLimitHasNothingLeft) {
  PaperOptions options;
  options.max_seconds = 20;
  const PaperForecast forecast = ForecastOf(options, {21, 21.4}, 545);
  EXPECT_EQ(forecast.text, "21 of about 21 blocks, about 0 s left");
  EXPECT_DOUBLE_EQ(forecast.fraction, 1.0);
}

}  // namespace
}  // namespace kvx
