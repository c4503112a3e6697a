// Stage `load`: a scan file or DICOM folder becomes a Scan.
#pragma once
#include <filesystem>

#include "core/study.h"
#include "pipeline/runner.h"

namespace kvx {

// SHA-256 of a file's bytes, with those of the data file beside a .mhd or .nhdr, or of the names and bytes of
// the files that a DICOM folder's reader looks at, in sorted order. Throws InputError for what cannot be
// read.
Digest ContentDigest(const std::filesystem::path& file_or_folder);

// A scan as stages see it: slices that take turns in brightness are evened out (slice_alternation.h), a CT
// whose greys are no Hounsfield units is one of unknown modality (Scan::denied_ct), and what lies outside the
// field of view is dark (WithoutImpossibleFilling). Throws InputError for what cannot be read, and for greys
// that nothing measures.
Scan ReadScanEvenly(const std::filesystem::path& path);

// As above, of a label map, or of the masks of `bones` in a folder (pipeline/io/mask_folder.h).
Digest LabelsDigest(const std::filesystem::path& labels, const std::vector<StudyBone>& bones);

// ReadScanEvenly. Throws InputError for a scan that is even everywhere, too.
struct LoadScan {
  static constexpr std::string_view kName = "load";
  static constexpr int kVersion = 7;
  struct Inputs {
    Digest content;              // ContentDigest(path)
    std::filesystem::path path;  // where the bytes lie today; not part of the key
    std::vector<Digest> Keys() const { return {content}; }
  };
  using Options = NoOptions;
  using Output = Scan;
  static Output Run(const Inputs& inputs, const Options&, StageContext& context);
};

}  // namespace kvx
