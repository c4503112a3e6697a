// Whom and what DICOM files that are written are of. Nothing of a scan's own header is in it but its
// modality, and it says so (patient identity removed).
#pragma once
#include <string>

#include "core/digest.h"

class DcmItem;

namespace kvx {

struct DicomSeries {
  std::string modality;     // MR, CT or SEG; anything else makes secondary capture images of modality OT
  std::string patient_id;   // our id of the subject; the patient's name stays empty
  Digest study;             // of a patient, equal digests: the same study
  Digest world;             // of a patient, equal digests: the same frame of reference
  std::string description;  // ASCII, at most 64 letters
  std::string comment;      // ASCII, at most 10240 letters
};

// `content`: what the series holds; equal digests are one series.
void PutOrigin(DcmItem& set, const DicomSeries& series, const Digest& content);

std::string SeriesUidOf(const Digest& content);

// All that PutOrigin says of the series.
Hasher& AddOrigin(Hasher& hasher, const DicomSeries& series);

}  // namespace kvx
