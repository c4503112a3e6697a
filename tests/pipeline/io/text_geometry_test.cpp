// What a NRRD or MetaImage header must say of its voxels' places: no scan gets a spacing that nobody gave it.
#include "pipeline/io/text_geometry.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "core/errors.h"
#include "pipeline/io/volume_file.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

using testing_support::ScratchFolder;

class TextGeometry : public testing::Test {
 protected:
  // The spacing that is read, or the complaint.
  std::string Read(const std::string& name, const std::string& header) {
    const std::filesystem::path file = folder_.path() / name;
    std::ofstream(file, std::ios::binary) << header << std::string(4 * 3 * 2, '\1');
    try {
      std::ostringstream spacing;
      spacing << ReadVolumeInfo(file).grid.spacing_mm.transpose();
      return spacing.str();
    } catch (const InputError& error) {
      return error.what();
    }
  }
  std::string Nrrd(const std::string& fields, const std::string& sizes = "4 3 2") {
    const std::string dimension = std::to_string(1 + std::ranges::count(sizes, ' '));
    return Read("a.nrrd", "NRRD0005\ntype: uchar\ndimension: " + dimension + "\nsizes: " + sizes +
                              "\nencoding: raw\n" + fields + "\n\n");
  }
  std::string Meta(const std::string& fields) {
    return Read("a.mha", "ObjectType = Image\nNDims = 3\nBinaryData = True\nDimSize = 4 3 2\n" + fields +
                             "\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n");
  }

  ScratchFolder folder_;
};

struct Case {
  const char *fields, *expected;
};

TEST_F(TextGeometry, ASpacingOfANrrdIsAPositiveNumber) {
  const Case cases[] = {
      {"spacings: 1 2 3", "1 2 3"},
      {"axis mins: 0 0 0\naxis maxs: 3 4 3\nspacings: 1 2 3", "1 2 3"},
      {"spacings: 1 2 nan", "not a positive number"},
      {"spacings: NaN NaN NaN", "not a positive number"},
      {"spacings: 1 2 0", "not a positive number"},
      {"spacings: 1 2 -3", "not a positive number"},
      {"spacings: 1 2 inf", "not a positive number"},
      {"spacings: 1 2 0,7", "not a positive number"},
      {"spacings: 1 2", "for each axis"},
      {"axis mins: 0 0 0\naxis maxs: 3 4 3", "how large its voxels are"},
      {"", "how large its voxels are"},
      {"space: left-posterior-superior\nspace origin: (1,2,3)", "how large its voxels are"},
  };
  for (const Case& c : cases) EXPECT_THAT(Nrrd(c.fields), testing::HasSubstr(c.expected)) << c.fields;
}

TEST_F(TextGeometry, AxesOfANrrdAreFiniteVectors) {
  const std::string lps = "space: left-posterior-superior\nspace directions: ";
  const Case cases[] = {
      {"(1,0,0) ( 0, 2, 0 ) (0,0,3)", "1 2 3"},
      {"(1,0,0) (0,2,0) none", "not finite"},
      {"(1,0,0) (0,2,0) (nan,nan,nan)", "not finite"},
      {"(1,0,0) (0,2,0) (0,0,nan)", "not finite"},
      {"(1,0,0) (0,2,0) (0,0,0)", "not a positive number"},
      {"(1,0,0) (0,2,0)", "for each axis"},
      {"(1,0,0) (0,2,0) (0,0,3)\nspace origin: (0,nan,0)", "not finite"},
  };
  for (const Case& c : cases) EXPECT_THAT(Nrrd(lps + c.fields), testing::HasSubstr(c.expected)) << c.fields;
  EXPECT_THAT(Nrrd("space: LPS\nspacings: 1 2 3"), testing::HasSubstr("space directions instead"));
}

// NRRD's own word for "none" is not a number, and these axes have none.
TEST_F(TextGeometry, AxesThatAreNotTheImagesNeedNoSpacing) {
  EXPECT_EQ(Nrrd("spacings: nan 1 2 3\nkinds: vector domain domain domain", "1 4 3 2"), "1 2 3");
  EXPECT_EQ(Nrrd("spacings: 1 2 3 nan", "4 3 2 1"), "1 2 3");
  EXPECT_EQ(Nrrd("space: LPS\nspace directions: none (1,0,0) (0,2,0) (0,0,3)\nkinds: list space space space",
                 "1 4 3 2"),
            "1 2 3");
}

TEST_F(TextGeometry, ASpaceIsOneThatAPatientLiesIn) {
  const std::string axes = "\nspace directions: (1,0,0) (0,2,0) (0,0,3)";
  for (const char* known :
       {"LPS", "left-posterior-superior", "left posterior superior", "RAS", "LAS", "scanner-xyz"})
    EXPECT_EQ(Nrrd(std::string("space: ") + known + axes), "1 2 3") << known;
  for (const char* with_time :
       {"LPST", "rast", "left-posterior-superior-time", "scanner-xyz-time", "scanner-xyzt"})
    EXPECT_THAT(Nrrd(std::string("space: ") + with_time + axes), testing::HasSubstr("space with time"));
  EXPECT_THAT(Nrrd("space: 3D-left-handed" + axes), testing::HasSubstr("left-handed"));
  EXPECT_THAT(Nrrd("space: left-posterior-inferior" + axes), testing::HasSubstr("not known here"));
  const std::string axes_in_time = "\nspace directions: (1,0,0,0) (0,2,0,0) (0,0,3,0) (0,0,0,1)";
  EXPECT_EQ(Nrrd("space: LPST" + axes_in_time, "4 3 2 1"), "1 2 3") << "one frame";
}

TEST_F(TextGeometry, OfAMetaImageToo) {
  const Case cases[] = {
      {"ElementSpacing = 1 2 3", "1 2 3"},
      {"ElementSize = 1 2 3", "1 2 3"},
      {"Offset = 1 2 3", "how large its voxels are"},
      {"ElementSpacing = 1 2 nan", "not a positive number"},
      {"ElementSpacing = 1 2 0", "not a positive number"},
      {"ElementSpacing = 1 2 -3", "not a positive number"},
      {"ElementSpacing = 1 2 0,7", "not a positive number"},
      {"ElementSpacing = 1 2", "for each axis"},
      {"ElementSpacing = 1 2 3\nOffset = 1 nan 0", "not finite"},
      {"ElementSpacing = 1 2 3\nTransformMatrix = 1 0 0 0 1 0 0 0 inf", "not finite"},
  };
  for (const Case& c : cases) EXPECT_THAT(Meta(c.fields), testing::HasSubstr(c.expected)) << c.fields;
}

}  // namespace
}  // namespace kvx
