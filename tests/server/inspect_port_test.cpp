// What an upload may hold, beyond what its reader asks of it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "core/errors.h"
#include "server/pipeline_ports.h"
#include "tests/support/fixtures.h"

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

}  // namespace
}  // namespace kvx
