// A volume as a DICOM series of single-frame images, zipped: what a PACS or a viewer of others takes.
#pragma once
#include <filesystem>
#include <string>

#include "core/digest.h"
#include "core/scan.h"

namespace kvx {

struct DicomSeries {
  std::string modality;     // MR or CT; anything else makes secondary capture images of modality OT
  std::string patient_id;   // our id of the subject; the patient's name stays empty
  Digest study;             // equal digests: the same study and frame of reference
  std::string description;  // ASCII, at most 64 letters
};

// Writes a zip with one image per plane k of the grid. World is DICOM's own, LPS mm: positions, orientation
// and spacing are the grid's. Values are stored in 16 bits: rounded for an integer `type` that they fit,
// otherwise the nearest multiple of a step, which the file states (rescale slope; for MR the real world value
// map). Every UID is derived from the content: the same volume gives the same bytes. Throws InputError for
// values that are not finite, Unavailable when the file cannot be written.
void WriteDicomZip(const std::filesystem::path& path, const Volume& volume, ScalarType type,
                   const DicomSeries& series);

}  // namespace kvx
