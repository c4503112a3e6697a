#include "core/host/progress.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace kvx {
namespace {

TEST(Progress, AskedToStopItThrowsAndTellsNothing) {
  std::vector<std::string> told;
  bool stop = false;
  const Progress progress([&](std::string_view stage, double) { told.emplace_back(stage); },
                          [&] { return stop; });
  progress.ThrowIfCancelled();
  progress.Report("load", 0.5);
  stop = true;
  EXPECT_THROW(progress.ThrowIfCancelled(), Cancelled);
  EXPECT_THROW(progress.Report("load", 1), Cancelled);
  EXPECT_EQ(told, std::vector<std::string>{"load"});
}

TEST(Progress, PartsAndSilentViewsStopAsTheWholeDoes) {
  bool stop = false;
  const Progress progress({}, [&] { return stop; });
  const Progress part = progress.Part(0.2, 0.6), silent = progress.Silent();
  EXPECT_NO_THROW(part.ThrowIfCancelled());
  EXPECT_NO_THROW(silent.ThrowIfCancelled());
  stop = true;
  EXPECT_THROW(part.ThrowIfCancelled(), Cancelled);
  EXPECT_THROW(silent.ThrowIfCancelled(), Cancelled);
}

TEST(Progress, ThatNobodyCanStopGoesOn) { EXPECT_NO_THROW(Progress().ThrowIfCancelled()); }

TEST(Progress, APartTellsItsShareOfTheWhole) {
  std::vector<double> told;
  const Progress progress([&](std::string_view, double fraction) { told.push_back(fraction); }, {});
  const Progress part = progress.Part(0.5, 1).Part(0, 0.5);
  part.Report("", 0), part.Report("", 1);
  part.Silent().Report("", 1);
  EXPECT_EQ(told, (std::vector<double>{0.5, 0.75}));
}

}  // namespace
}  // namespace kvx
