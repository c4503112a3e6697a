// Relative intensities in bins.
#include "pipeline/segmentation/mr/levels/intensity_mixture.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

// Beside strokes in air, where the marrow's level is next to nothing, tissue is 1e9 and more.
TEST(IntensityCounts, CountWhatLiesBeyondAtTheEnds) {
  IntensityCounts counts;
  for (const double dark : {-0.1, -1e30}) EXPECT_EQ(counts.BinOf(dark), 0) << dark;
  for (const double bright : {2.0, 1e9, 1e30}) {
    EXPECT_EQ(counts.BinOf(bright), IntensityCounts::kBins - 1) << bright;
    counts.Add(bright);
  }
  EXPECT_GT(counts.Quantile(0.5), 1.9);
}

TEST(IntensityCounts, ABinHoldsItsCentre) {
  for (int bin = 0; bin < IntensityCounts::kBins; ++bin)
    EXPECT_EQ(IntensityCounts::BinOf(IntensityCounts::CentreOf(bin)), bin);
}

}  // namespace
}  // namespace kvx
