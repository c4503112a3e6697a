// DICOM segmentations (SEG) of few voxels.
#pragma once
#include "tests/support/dicom_bytes.h"

namespace kvx::testing_support {

// Eight by eight voxels of a segment at z = `z` mm.
struct SegmentFrame {
  int segment = 1, z = 0;
  std::string voxels = {};  // as they are stored; where it does not say, as of WriteSegmentation
};

struct SegmentationFile {
  int segments = 1;
  std::vector<int> places{0, 1, 2};       // of each segment's frames
  std::vector<SegmentFrame> frames = {};  // instead of the segments at those places
  std::string between = {};               // from plane to plane, where it says so
  uint16_t certain = 0;                   // of probabilities: the value of what is sure
  bool tells_segments = true;             // of each frame
  uint16_t numbered_bits = 0;             // of a label map, whose voxels are the numbers of segments
  const char* shown = "MONOCHROME2";
  bool packed = false;  // by run lengths
};

// A bit a voxel: (0, 0) is inside, and of the last row the first half. Of probabilities (0, 0) is sure, (1,
// 0) is a half and (2, 0) a little less.
inline std::string UsualVoxels(const SegmentationFile& of) {
  if (of.certain == 0) return std::string("\1\0\0\0\0\0\0\17", 8);
  std::string voxels(64, '\0');
  voxels[0] = char(of.certain), voxels[1] = char((of.certain + 1) / 2),
  voxels[2] = char((of.certain - 1) / 2);
  return voxels;
}

// A frame of 64 bytes as a literal run in a single segment (PS3.5, G.3).
inline std::string RunLengths(const std::string& voxels) {
  std::string head(64, '\0');
  head[0] = 1, head[4] = 64;
  return head + char(63) + voxels + '\0';
}

inline std::vector<SegmentFrame> FramesOf(const SegmentationFile& of) {
  std::vector<SegmentFrame> frames = of.frames;
  for (int segment = 1; of.frames.empty() && segment <= of.segments; ++segment)
    for (const int z : of.places) frames.push_back({segment, z});
  return frames;
}

inline DicomBytes SegmentNumbered(int segment) {
  return DicomBytes()
      .Short(0x00620004, uint16_t(segment))
      .Text(0x00620005, "LO", "Bone " + std::to_string(segment));
}

inline void WriteSegmentation(const std::filesystem::path& path, const SegmentationFile& of) {
  const std::vector<SegmentFrame> frames = FramesOf(of);
  std::vector<DicomBytes> list, groups;
  for (int segment = 1; segment <= of.segments; ++segment) list.push_back(SegmentNumbered(segment));
  std::string voxels;
  std::vector<std::string> fragments;
  for (const SegmentFrame& frame : frames) {
    DicomBytes group;
    group.Sequence(0x00209113, {DicomBytes().Text(0x00200032, "DS", "0\\0\\" + std::to_string(frame.z))});
    if (of.tells_segments && of.numbered_bits == 0)
      group.Sequence(0x0062000a, {DicomBytes().Short(0x0062000b, uint16_t(frame.segment))});
    groups.push_back(group);
    voxels += frame.voxels.empty() ? UsualVoxels(of) : frame.voxels;
    if (of.packed) fragments.push_back(RunLengths(frame.voxels));
  }
  const char* kind = of.numbered_bits ? DicomBytes::kLabelMapSegmentation : DicomBytes::kSegmentation;
  const char* type = of.numbered_bits ? "LABELMAP" : of.certain > 0 ? "FRACTIONAL" : "BINARY";
  const uint16_t depth = of.numbered_bits ? of.numbered_bits : of.certain > 0 ? 8 : 1;
  DicomBytes image;
  image.Text(0x00080016, "UI", kind).Text(0x00080018, "UI", "2.25.8");
  image.Text(0x00080060, "CS", "SEG").Text(0x0020000d, "UI", "2.25.3").Text(0x0020000e, "UI", "2.25.5");
  image.Short(0x00280002, 1).Text(0x00280004, "CS", of.shown);
  image.Text(0x00280008, "IS", std::to_string(frames.size())).Short(0x00280010, 8).Short(0x00280011, 8);
  image.Short(0x00280100, depth).Short(0x00280101, depth).Short(0x00280102, uint16_t(depth - 1));
  image.Short(0x00280103, 0).Text(0x00620001, "CS", type);
  image.Sequence(0x00620002, list);
  if (of.certain > 0) image.Short(0x0062000e, of.certain);
  DicomBytes measures;
  if (!of.between.empty()) measures.Text(0x00180088, "DS", of.between);
  measures.Text(0x00280030, "DS", "1\\1");
  image.Sequence(0x52009229,
                 {DicomBytes()
                      .Sequence(0x00209116, {DicomBytes().Text(0x00200037, "DS", "1\\0\\0\\0\\1\\0")})
                      .Sequence(0x00289110, {measures})});
  image.Sequence(0x52009230, groups);
  if (of.packed)
    image.Fragments(0x7fe00010, fragments);
  else
    image.Words(0x7fe00010, voxels);
  image.WriteTo(path, kind, of.packed ? DicomBytes::kRunLengths : DicomBytes::kExplicitLittleEndian);
}

// All segments at the same three places, from z = `first_slice` mm on.
inline void WriteSegmentation(const std::filesystem::path& path, int segments, int first_slice = 0) {
  WriteSegmentation(path, {segments, {first_slice, first_slice + 1, first_slice + 2}});
}

}  // namespace kvx::testing_support
