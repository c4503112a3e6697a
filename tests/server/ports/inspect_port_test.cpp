// What an upload may hold, beyond what its reader asks of it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "core/errors.h"
#include "pipeline/io/volume_file.h"
#include "server/ports/pipeline_ports.h"
#include "tests/support/fixtures.h"
#include "tests/support/plain_grid.h"

namespace kvx {
namespace {

using testing::HasSubstr;

template <class Inspect>
std::string RefusalOf(const Inspect& inspect) {
  try {
    inspect();
  } catch (const InputError& error) {
    return error.what();
  }
  return "";
}

TEST(PipelineInspector, MoreVoxelsThanItTakesAreRefusedWithTheirNumberAndTheMost) {
  const testing_support::ScratchFolder scratch;
  const auto file = scratch.path() / "a.mha";
  std::ofstream(file) << "ObjectType = Image\nNDims = 3\nDimSize = 1024 1024 513\nElementSpacing = 1 1 1\n"
                         "ElementType = MET_UCHAR\nElementDataFile = LOCAL\n";
  std::filesystem::resize_file(file, std::filesystem::file_size(file) + 1024 * 1024 * 513);  // a hole
  PipelineInspector inspector;
  const auto tells = testing::AllOf(HasSubstr("has 537919488 voxels"), HasSubstr("takes 536870912 at most"),
                                    HasSubstr("coarser"));
  EXPECT_THAT(RefusalOf([&] { inspector.InspectScan(file, "lab"); }), tells);
  EXPECT_THAT(RefusalOf([&] { inspector.InspectLabels(file, "knee", "lab"); }), tells);
}

// Of eight bits: no more values than a body has bones.
TEST(PipelineInspector, AScanOfFewGreysIsNoLabelMap) {
  const testing_support::ScratchFolder scratch;
  const auto file = scratch.path() / "a.nrrd";
  LabelMap scan(testing_support::PlainGrid({30, 30, 30}, {1, 1, 1}, {0, 0, 0}));
  for (size_t v = 0; v < scan.values.size(); ++v) scan.values[v] = uint16_t(v * 2654435761u >> 7 & 127);
  WriteLabels(file, scan);
  PipelineInspector inspector;
  EXPECT_THAT(RefusalOf([&] { inspector.InspectLabels(file, "knee", "lab"); }),
              HasSubstr("that is a scan, not a label map"));
}

}  // namespace
}  // namespace kvx
