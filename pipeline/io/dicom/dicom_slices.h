// The images of a DICOM series as planes of one grid: where they lie, not what they show.
#pragma once
#include <vector>

#include "pipeline/io/dicom/dicom_header.h"

namespace kvx {

struct DicomSlice {
  size_t file = 0, frame = 0;  // of that file
  DicomFrame place;
  double along_normal_mm = 0;
  size_t plane = 0;  // of the grid
};

struct DicomSlices {
  std::vector<DicomSlice> slices;  // by place along the normal
  Grid grid;                       // without its size
  Grid GridOf(int columns, int rows) const;
};

// Whether two images do not lie in parallel planes, with rows alike.
bool Turned(const DicomFrame& a, const DicomFrame& b);

// Both order slices by their place along the common normal, never by file name or instance number. They throw
// InputError for slices that are turned, shifted or unevenly spaced, that have different spacings, or of
// which several lie at one place. Of a scan: every plane has its slice.
DicomSlices PlaceScan(const std::vector<DicomFile>& files);
// Of a segmentation: each segment has slices of its own, and planes without it are mostly left out.
DicomSlices PlaceSegments(const std::vector<DicomFile>& files);

}  // namespace kvx
