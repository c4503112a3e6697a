// A volume as a DICOM series of single-frame images, zipped: what a PACS or a viewer of others takes.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "core/scan.h"
#include "pipeline/io/dicom/dicom_origin.h"

namespace kvx {

// What a stored value means, and which of them are shown: the same for all series of a model, so that viewers
// show its poses alike.
struct DicomGreys {
  double step = 1;                      // value = step * stored, stored in 16 bits with sign
  int window_low = 0, window_high = 1;  // stored values at the ends of the usual window
};
// Step 1 for integers that fit, and for a range that has a thousand whole numbers; otherwise the least of 1,
// 2, 5 times a power of ten that brings the largest value into 16 bits. Posed values lie between the
// template's. Throws InputError for values that are not finite.
DicomGreys DicomGreysOf(const Scan& of_template);

// The identifiers (UIDs) of what WriteDicomZip writes.
struct DicomImages {
  std::string sop_class, series;
  std::vector<std::string> images;  // of each plane k
};
DicomImages ImagesOf(const Volume& volume, const DicomGreys& greys, const DicomSeries& series);

// Writes a zip with one image per plane k of the grid. World is DICOM's own, LPS mm: positions, orientation
// and spacing are the grid's. Values become the nearest multiple of the step, which the file states as
// rescale slope (for MR as real world value map too, and as neither where it is 1). Every UID and the series'
// number are derived from the content: the same volume gives the same bytes. Throws InputError for values
// that are not finite, Unavailable when the file cannot be written.
void WriteDicomZip(const std::filesystem::path& path, const Volume& volume, const DicomGreys& greys,
                   const DicomSeries& series);

}  // namespace kvx
