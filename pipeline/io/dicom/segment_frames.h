// The voxels of a DICOM segmentation as they are stored. A frame of each segment and plane makes a whole
// body's far larger than a scan's, so they are taken one by one.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "pipeline/io/dicom/dicom_header.h"

namespace kvx {

class SegmentFrames {
 public:
  // Reads the file. Throws InputError for what is damaged or packed in a way that is not read.
  explicit SegmentFrames(const DicomFile& file);
  // Row by row. One bit a voxel is 0 or 1.
  std::vector<uint16_t> Frame(size_t frame) const;

 private:
  size_t voxels_;  // of a frame
  size_t bits_ = 0;
  std::string stored_;
};

}  // namespace kvx
