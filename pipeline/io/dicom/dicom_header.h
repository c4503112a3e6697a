// What of a DICOM file's header places its images in the patient. Voxels are not touched.
#pragma once
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "core/frames.h"
#include "pipeline/io/voxel_values.h"

namespace kvx {

struct DicomFrame {
  Eigen::Vector3d position_mm;  // LPS, centre of the first voxel
  Eigen::Vector3d along_row, along_column;
  Eigen::Vector2d spacing_mm;  // between columns, between rows
  int segment = 0;             // of a segmentation: the number of its segment; 0 where it is not told
};

// What the numbers of a file are of. Others: doses, images of a treatment, what is said about images.
enum class DicomContent { kBody, kSegments, kOther };

struct DicomFile {
  std::filesystem::path path;
  std::string series, echo;  // identify what belongs together; never shown
  std::string modality;      // "MR", "CT" or ""
  bool localiser = false;    // by its own account
  DicomContent content = DicomContent::kBody;
  int columns = 0, rows = 0;
  bool numbered = false;                     // a segmentation whose voxels are the numbers of their segments
  size_t certain = 0;                        // of a segmentation of probabilities: the value of what is sure
  std::map<int, std::string> segment_names;  // of a segmentation: what it calls its segments, by number
  double between_mm = 0;                     // from plane to plane, where it says so
  std::vector<DicomFrame> frames;            // in the file's order; none where it does not say where they lie
  // The number of frames by the file's word, and of those whose places it tells, where they differ.
  std::optional<std::pair<size_t, size_t>> miscounted;
  Rescale rescale;            // of all frames, by the file's word
  bool coloured = false;      // by a palette or by three values a voxel
  bool of_known_kind = true;  // the decoder reads images of its SOP class
  // Shown inverted (MONOCHROME1): the decoder gives this less what is stored.
  std::optional<double> inverted_from;
};

// Nothing for a file that is not a DICOM image. Throws InputError for a DICOM image that is damaged, packed
// in a way that is not known, without its high bit or with one that is not that of its stored bits, rescaled
// by 0, by what is not a number or differently frame by frame, or inverted in a way that the decoder does not
// read.
std::optional<DicomFile> ReadDicomHeader(const std::filesystem::path& path);

}  // namespace kvx
