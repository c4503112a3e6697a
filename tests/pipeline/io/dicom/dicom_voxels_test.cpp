// The numbers of DICOM images: all of them, and those that their headers mean.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/errors.h"
#include "pipeline/io/dicom/dicom_header.h"
#include "pipeline/io/volume_file.h"
#include "tests/support/dicom_bytes.h"
#include "tests/support/fixtures.h"
#include "tests/support/refusal.h"

namespace kvx {
namespace {
using namespace testing_support;
using testing::HasSubstr;

std::string Complaint(const std::filesystem::path& path) {
  return RefusalOf<InputError>([&] { ReadScan(path); }, "none");
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
    EXPECT_THAT(Complaint(folder.path()), HasSubstr("as many voxels")) << cut;
  }
}

TEST(DicomVoxels, AnElementTooShortForItsImageIsNoticed) {
  const ScratchFolder folder;
  for (int slice = 0; slice < 3; ++slice) {
    DicomBytes image = ElementsOf({.slice = slice, .voxels = std::string("\3\0\3\0", 4)});
    image.Words(0xfffcfffc, std::string(100, '\0')).WriteTo(folder.path() / (std::to_string(slice) + ".dcm"));
  }
  EXPECT_THAT(Complaint(folder.path()), HasSubstr("as many voxels"));
}

// Three frames of two by two voxels, all 3, which the functional groups that all frames share rescale.
void WriteFrames(const std::filesystem::path& path, const char* sop_class, const char* count = "3",
                 int planes = 3) {
  DicomBytes image;
  std::vector<DicomBytes> frames;
  for (const char* place : {"0\\0\\0", "0\\0\\1", "0\\0\\2"})
    frames.push_back(DicomBytes().Sequence(0x00209113, {DicomBytes().Text(0x00200032, "DS", place)}));
  std::string voxels;
  for (int v = 0; v < planes * 2 * 2; ++v) voxels += std::string("\3\0", 2);
  image.Text(0x00080016, "UI", sop_class).Text(0x00080018, "UI", "2.25.8").Text(0x00080060, "CS", "MR");
  image.Text(0x0020000d, "UI", "2.25.3").Text(0x0020000e, "UI", "2.25.5").Short(0x00280002, 1);
  image.Text(0x00280004, "CS", "MONOCHROME2").Text(0x00280008, "IS", count).Short(0x00280010, 2);
  image.Short(0x00280011, 2).Short(0x00280100, 16).Short(0x00280101, 16).Short(0x00280102, 15);
  image.Short(0x00280103, 0);
  image.Sequence(0x52009229,
                 {DicomBytes()
                      .Sequence(0x00209116, {DicomBytes().Text(0x00200037, "DS", "1\\0\\0\\0\\1\\0")})
                      .Sequence(0x00289110, {DicomBytes().Text(0x00280030, "DS", "1\\1")})
                      .Sequence(0x00289145,
                                {DicomBytes().Text(0x00281052, "DS", "-1024").Text(0x00281053, "DS", "2")})});
  image.Sequence(0x52009230, frames).Words(0x7fe00010, voxels).WriteTo(path, sop_class);
}

TEST(DicomVoxels, FramesAreAsManyAsTheImageSays) {
  const ScratchFolder folder;
  const auto complaint = [&](const char* count, int planes) {
    WriteFrames(folder.path() / "frames.dcm", DicomBytes::kEnhancedCt, count, planes);
    return Complaint(folder.path() / "frames.dcm");
  };
  EXPECT_EQ(complaint("3", 3), "none");
  for (const char* count : {"2", "4", "1"}) {
    EXPECT_THAT(complaint(count, 3),
                HasSubstr(std::string("holds ") + count + " frames (Number of Frames), but"));
    EXPECT_THAT(complaint(count, 3), HasSubstr("where 3 of them lie"));
  }
  for (const int planes : {2, 4, 6})
    EXPECT_THAT(complaint("3", planes), HasSubstr("not hold as many voxels as its rows, columns and number"));
}

// Three slices whose voxels are packed, in two fragments each.
void WritePacked(const std::filesystem::path& folder, const char* transfer_syntax) {
  for (int slice = 0; slice < 3; ++slice) {
    HeaderOf({.slice = slice})
        .Fragments(0x7fe00010, {std::string(8, '\1'), std::string(8, '\2')})
        .WriteTo(folder / (std::to_string(slice) + ".dcm"), DicomBytes::kCtImage, transfer_syntax);
  }
}

TEST(DicomVoxels, WhatTheDecoderDoesNotKnowIsNotCalledDamaged) {
  const ScratchFolder folder;
  for (const char* syntax : {DicomBytes::kHighThroughputJpeg2000, "1.2.3.99", DicomBytes::kMpeg4}) {
    WritePacked(folder.path(), syntax);
    EXPECT_THAT(Complaint(folder.path()), HasSubstr("packed in a way that is not read here")) << syntax;
    EXPECT_THAT(Complaint(folder.path()), HasSubstr("uncompressed (Explicit VR Little Endian)")) << syntax;
  }
  for (int slice = 0; slice < 3; ++slice)
    ElementsOf({.slice = slice, .sop_class = "1.3.12.2.1107.5.9.1"})
        .WriteTo(folder.path() / (std::to_string(slice) + ".dcm"), "1.3.12.2.1107.5.9.1");
  EXPECT_THAT(Complaint(folder.path()), HasSubstr("of a kind (SOP class) that is not read here"));
}

// How an image is shown does not change what was measured.
TEST(DicomVoxels, HounsfieldUnitsThatAreShownInvertedStayThose) {
  const ScratchFolder folder;
  const auto written = [&](CtSlice like) {
    for (like.slice = 0; like.slice < 3; ++like.slice)
      WriteCtSlice(folder.path() / (std::to_string(like.slice) + ".dcm"), like);
    return folder.path();
  };
  for (const CtSlice& like : {CtSlice{}, CtSlice{.bits = 13}, CtSlice{.is_signed = 0},
                              CtSlice{.bits = 12, .is_signed = 0}, CtSlice{.slope = "2"}}) {
    const Scan straight = ReadScan(written(like));
    CtSlice inverted = like;
    inverted.shown = "MONOCHROME1";
    const Scan scan = ReadScan(written(inverted));
    EXPECT_EQ(scan.volume.values, straight.volume.values) << like.bits << " bits, slope " << like.slope;
    EXPECT_EQ(scan.stored_as, straight.stored_as);
    EXPECT_EQ(scan.volume.values[0], 3 * std::stof(like.slope));
  }
  EXPECT_EQ(ReadScan(written({.modality = "MR", .shown = "MONOCHROME1"})).volume.values[0], -1 - 3)
      << "of other images greys count as they are shown";
  EXPECT_THAT(Complaint(written({.shown = "MONOCHROME1", .bits = 12})), HasSubstr("MONOCHROME1"))
      << "the decoder would end the process";
}

// The begin of a codestream of one component (ISO/IEC 15444-1, A.4.1 and A.5.1).
std::string CodestreamOf(int bits) {
  return std::string("\xff\x4f\xff\x51\0\x29", 6) + std::string(36, '\0') + char(bits - 1) + "\1\1";
}

// Converters write codestreams of all bits allocated, of which the decoder inverts each.
TEST(DicomVoxels, InvertedCodestreamsHoldTheBitsThatAreStored) {
  const ScratchFolder folder;
  const auto path = folder.path() / "0.dcm";
  const auto complaint = [&](int bits_of_codestream, const char* shown) {
    HeaderOf({.shown = shown, .bits = 12, .is_signed = 0})
        .Fragments(0x7fe00010, {CodestreamOf(bits_of_codestream)})
        .WriteTo(path, DicomBytes::kCtImage, DicomBytes::kJpeg2000);
    return RefusalOf<InputError>([&] { ReadDicomHeader(path); }, "none");
  };
  EXPECT_THAT(complaint(16, "MONOCHROME1"), HasSubstr("MONOCHROME1"));
  EXPECT_EQ(complaint(12, "MONOCHROME1"), "none");
  EXPECT_EQ(complaint(16, "MONOCHROME2"), "none");
}

TEST(DicomVoxels, WithoutTheHighBitThereAreNoVoxels) {
  const ScratchFolder folder;
  for (int slice = 0; slice < 3; ++slice)
    WriteCtSlice(folder.path() / (std::to_string(slice) + ".dcm"), {.slice = slice, .has_high_bit = false});
  EXPECT_THAT(Complaint(folder.path()), HasSubstr("high bit"));
}

// 100 in the upper twelve of sixteen bits is stored as 1600.
TEST(DicomVoxels, ValuesThatDoNotBeginAtTheLowestBitAreRefused) {
  const ScratchFolder folder;
  const auto write = [&](uint16_t high_bit, const std::string& voxel) {
    for (int slice = 0; slice < 3; ++slice)
      WriteCtSlice(
          folder.path() / (std::to_string(slice) + ".dcm"),
          {.slice = slice, .voxels = voxel + voxel + voxel + voxel, .bits = 12, .high_bit = high_bit});
  };
  write(15, "\x40\x06");
  EXPECT_THAT(Complaint(folder.path()), HasSubstr("lowest bit"));
  write(11, "\x64" + std::string(1, '\0'));
  EXPECT_THAT(ReadScan(folder.path()).volume.values, testing::Each(100));
}

TEST(DicomVoxels, ARescaleThatIsNotANumberIsRefused) {
  const ScratchFolder folder;
  const auto told = [&](const std::string& slope, const std::string& intercept) {
    for (int slice = 0; slice < 3; ++slice)
      WriteCtSlice(folder.path() / (std::to_string(slice) + ".dcm"),
                   {.slice = slice, .slope = slope, .intercept = intercept});
    return Complaint(folder.path());
  };
  for (const char* not_one : {"0,5", "nan", "2\\3", "many"}) {
    EXPECT_THAT(told(not_one, "0"), HasSubstr("not a number")) << not_one;
    EXPECT_THAT(told("1", not_one), HasSubstr("not a number")) << not_one;
  }
  EXPECT_EQ(told("", ""), "none") << "as where they are absent";
  EXPECT_EQ(told(" 2 ", "+1e1"), "none");
  EXPECT_THAT(ReadScan(folder.path()).volume.values, testing::Each(16));
}

// The decoder looks for a rescale in the functional groups of some kinds of images only.
TEST(DicomVoxels, EveryKindOfImageIsRescaledAsItSays) {
  const ScratchFolder folder;
  for (const char* kind :
       {DicomBytes::kMultiframeCapture, DicomBytes::kEnhancedMrColour, DicomBytes::kEnhancedCt}) {
    WriteFrames(folder.path() / "frames.dcm", kind);
    const Scan scan = ReadScan(folder.path() / "frames.dcm");
    EXPECT_THAT(scan.volume.values, testing::Each(2 * 3 - 1024)) << kind;
    EXPECT_EQ(ReadVolumeInfo(folder.path() / "frames.dcm").stored_as, scan.stored_as) << kind;
  }
}

}  // namespace
}  // namespace kvx
