// DICOM segmentations (SEG) of few bits.
#pragma once
#include "tests/support/dicom_bytes.h"

namespace kvx::testing_support {

// Of eight by eight voxels and three frames a segment, all at the same three places, from z = `first_slice`
// mm on, a bit a voxel: (0, 0) is inside, and of the last row the first half.
inline void WriteSegmentation(const std::filesystem::path& path, int segments, int first_slice = 0) {
  DicomBytes image;
  std::vector<DicomBytes> list, frames;
  for (int segment = 1; segment <= segments; ++segment) {
    list.push_back(DicomBytes().Short(0x00620004, uint16_t(segment)));
    for (int slice = first_slice; slice < first_slice + 3; ++slice) {
      const DicomBytes place = DicomBytes().Text(0x00200032, "DS", "0\\0\\" + std::to_string(slice));
      frames.push_back(DicomBytes().Sequence(0x00209113, {place}));
    }
  }
  std::string bits;
  for (size_t f = 0; f < frames.size(); ++f) bits += std::string("\1\0\0\0\0\0\0\17", 8);
  image.Text(0x00080016, "UI", DicomBytes::kSegmentation).Text(0x00080018, "UI", "2.25.8");
  image.Text(0x00080060, "CS", "SEG").Text(0x0020000d, "UI", "2.25.3").Text(0x0020000e, "UI", "2.25.5");
  image.Short(0x00280002, 1).Text(0x00280004, "CS", "MONOCHROME2");
  image.Text(0x00280008, "IS", std::to_string(frames.size())).Short(0x00280010, 8).Short(0x00280011, 8);
  image.Short(0x00280100, 1).Short(0x00280101, 1).Short(0x00280102, 0).Short(0x00280103, 0);
  image.Sequence(0x00620002, list);
  image.Sequence(0x52009229,
                 {DicomBytes()
                      .Sequence(0x00209116, {DicomBytes().Text(0x00200037, "DS", "1\\0\\0\\0\\1\\0")})
                      .Sequence(0x00289110, {DicomBytes().Text(0x00280030, "DS", "1\\1")})});
  image.Sequence(0x52009230, frames);
  image.Words(0x7fe00010, bits);
  image.WriteTo(path, DicomBytes::kSegmentation);
}

}  // namespace kvx::testing_support
