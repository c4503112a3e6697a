// Files of every format that the service takes, read by the real program under the limits of its reader.
#include <gtest/gtest.h>

#include "pipeline/io/volume_file.h"
#include "server/ports/child_inspector.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

using testing_support::LinearRamp;
using testing_support::ObliqueGrid;

TEST(InspectUpload, EveryFormatIsReadByTheServicesChild) {
  const testing_support::ScratchFolder folder;
  const Grid grid = ObliqueGrid({9, 8, 7});
  LabelMap labels(grid);
  for (size_t v = 100; v < 200; ++v) labels.values[v] = 3;
  ChildInspector inspector(KVX_PROGRAM);
  for (const char* ending : {".nii", ".nii.gz", ".nrrd", ".mha"}) {
    const auto scan = folder.path() / (std::string("scan") + ending),
               map = folder.path() / (std::string("labels") + ending);
    WriteVolume(scan, LinearRamp{}.On(grid), ScalarType::kInt16);
    WriteLabels(map, labels);
    EXPECT_EQ(inspector.InspectScan(scan, "lab").grid.size, grid.size) << ending;
    EXPECT_EQ(inspector.InspectLabels(map, "custom", "lab").labels, std::vector<int>{3}) << ending;
  }
}

}  // namespace
}  // namespace kvx
