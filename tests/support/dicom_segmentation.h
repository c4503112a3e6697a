// DICOM segmentations (SEG) of few bits.
#pragma once
#include "tests/support/dicom_bytes.h"

namespace kvx::testing_support {

struct SegmentationFile {
  int segments = 1;
  std::vector<int> places{0, 1, 2};  // of each segment's frames, z in mm
  std::string between = {};          // from plane to plane, where it says so
  uint16_t certain = 0;              // of probabilities: the value of what is sure
};

// Of eight by eight voxels, a bit a voxel: (0, 0) is inside, and of the last row the first half. Of
// probabilities (0, 0) is sure, (1, 0) is a half and (2, 0) a little less.
inline void WriteSegmentation(const std::filesystem::path& path, const SegmentationFile& of) {
  DicomBytes image;
  std::vector<DicomBytes> list, frames;
  for (int segment = 1; segment <= of.segments; ++segment) {
    list.push_back(DicomBytes().Short(0x00620004, uint16_t(segment)));
    for (const int z : of.places) {
      const DicomBytes place = DicomBytes().Text(0x00200032, "DS", "0\\0\\" + std::to_string(z));
      frames.push_back(DicomBytes().Sequence(0x00209113, {place}));
    }
  }
  const uint16_t depth = of.certain > 0 ? 8 : 1;
  std::string frame("\1\0\0\0\0\0\0\17", 8), voxels;
  if (of.certain > 0) {
    frame.assign(64, '\0');
    frame[0] = char(of.certain), frame[1] = char((of.certain + 1) / 2), frame[2] = char((of.certain - 1) / 2);
  }
  for (size_t f = 0; f < frames.size(); ++f) voxels += frame;
  image.Text(0x00080016, "UI", DicomBytes::kSegmentation).Text(0x00080018, "UI", "2.25.8");
  image.Text(0x00080060, "CS", "SEG").Text(0x0020000d, "UI", "2.25.3").Text(0x0020000e, "UI", "2.25.5");
  image.Short(0x00280002, 1).Text(0x00280004, "CS", "MONOCHROME2");
  image.Text(0x00280008, "IS", std::to_string(frames.size())).Short(0x00280010, 8).Short(0x00280011, 8);
  image.Short(0x00280100, depth).Short(0x00280101, depth).Short(0x00280102, uint16_t(depth - 1));
  image.Short(0x00280103, 0).Text(0x00620001, "CS", of.certain > 0 ? "FRACTIONAL" : "BINARY");
  image.Sequence(0x00620002, list);
  if (of.certain > 0) image.Short(0x0062000e, of.certain);
  DicomBytes measures;
  if (!of.between.empty()) measures.Text(0x00180088, "DS", of.between);
  measures.Text(0x00280030, "DS", "1\\1");
  image.Sequence(0x52009229,
                 {DicomBytes()
                      .Sequence(0x00209116, {DicomBytes().Text(0x00200037, "DS", "1\\0\\0\\0\\1\\0")})
                      .Sequence(0x00289110, {measures})});
  image.Sequence(0x52009230, frames);
  image.Words(0x7fe00010, voxels);
  image.WriteTo(path, DicomBytes::kSegmentation);
}

// All segments at the same three places, from z = `first_slice` mm on.
inline void WriteSegmentation(const std::filesystem::path& path, int segments, int first_slice = 0) {
  WriteSegmentation(path, {segments, {first_slice, first_slice + 1, first_slice + 2}});
}

}  // namespace kvx::testing_support
