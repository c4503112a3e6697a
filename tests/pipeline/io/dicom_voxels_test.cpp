// The numbers of DICOM images: all of them, and those that their headers mean.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/errors.h"
#include "pipeline/io/volume_file.h"
#include "tests/support/dicom_bytes.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;
using testing::HasSubstr;

std::string Complaint(const std::filesystem::path& path) {
  try {
    ReadScan(path);
  } catch (const InputError& error) {
    return error.what();
  }
  return "none";
}

// Some scanners put a hundred kilobytes of notes in front of the voxels.
TEST(DicomVoxels, ALongHeaderDoesNotCountAsVoxels) {
  const ScratchFolder folder;
  DicomBytes notes;
  notes.Text(0x00290010, "LO", "NOTES").Words(0x00291010, std::string(100000, '\1'));
  for (int slice = 0; slice < 3; ++slice)
    WriteCtSlice(folder.path() / (std::to_string(slice) + ".dcm"), {.slice = slice, .more = notes});
  ASSERT_EQ(Complaint(folder.path()), "none");
  const auto second = folder.path() / "1.dcm";
  const auto size = std::filesystem::file_size(second);
  for (const int cut : {2, 4, 6, 8}) {  // of the eight bytes of voxels
    std::filesystem::resize_file(second, size - uintmax_t(cut));
    EXPECT_THAT(Complaint(folder.path()), HasSubstr("damaged")) << cut;
  }
}

TEST(DicomVoxels, AnElementTooShortForItsImageIsNoticed) {
  const ScratchFolder folder;
  for (int slice = 0; slice < 3; ++slice) {
    DicomBytes image = ElementsOf({.slice = slice, .voxels = std::string("\3\0\3\0", 4)});
    image.Words(0xfffcfffc, std::string(100, '\0')).WriteTo(folder.path() / (std::to_string(slice) + ".dcm"));
  }
  EXPECT_THAT(Complaint(folder.path()), HasSubstr("damaged"));
}

}  // namespace
}  // namespace kvx
