#include "pipeline/io/dicom/dicom_origin.h"

#include <set>

#include "core/version.h"
#include "pipeline/io/dicom/dicom_elements.h"

namespace kvx {
namespace {

// Two patients share none, though they may have the same scans.
std::string UidOf(const DicomSeries& series, const Digest& digest, std::string_view what) {
  return UidOf(Hasher().Add(digest).Add(series.patient_id).Finish(), what);
}

// Not zero. Series of a study seldom have the same: archives list and sort by it.
int SeriesNumberOf(const Digest& content) {
  constexpr int kMost = 999999;
  int number = 0;
  for (int b = 0; b < 3; ++b) number = number << 8 | content.bytes[b];
  return 1 + number % kMost;
}

}  // namespace

void PutOrigin(DcmItem& set, const DicomSeries& series, const Digest& content) {
  static const std::set<std::string> kKnown{"MR", "CT", "SEG"};
  Put(set, DCM_PatientName, EVR_PN, "");
  Put(set, DCM_PatientID, EVR_LO, series.patient_id);
  Put(set, DCM_PatientBirthDate, EVR_DA, "");
  Put(set, DCM_PatientSex, EVR_CS, "");
  Put(set, DCM_PatientIdentityRemoved, EVR_CS, "YES");
  Put(set, DCM_DeidentificationMethod, EVR_LO, "Made anew: of the scans' headers only modality and geometry");
  Put(set, DCM_LongitudinalTemporalInformationModified, EVR_CS, "REMOVED");
  Put(set, DCM_StudyInstanceUID, EVR_UI, UidOf(series, series.study, "study"));
  Put(set, DCM_StudyDate, EVR_DA, "");
  Put(set, DCM_StudyTime, EVR_TM, "");
  Put(set, DCM_ReferringPhysicianName, EVR_PN, "");
  Put(set, DCM_StudyID, EVR_SH, "");
  Put(set, DCM_AccessionNumber, EVR_SH, "");
  Put(set, DCM_Modality, EVR_CS, kKnown.contains(series.modality) ? series.modality : "OT");
  Put(set, DCM_SeriesInstanceUID, EVR_UI, SeriesUidOf(content));
  Put(set, DCM_SeriesNumber, EVR_IS, std::to_string(SeriesNumberOf(content)));
  Put(set, DCM_SeriesDescription, EVR_LO, series.description);
  if (series.modality != "SEG") Put(set, DCM_Laterality, EVR_CS, "");
  Put(set, DCM_PatientPosition, EVR_CS, "");
  Put(set, DCM_FrameOfReferenceUID, EVR_UI, UidOf(series, series.world, "frame of reference"));
  Put(set, DCM_PositionReferenceIndicator, EVR_LO, "");
  Put(set, DCM_Manufacturer, EVR_LO, "Kinevox");
  Put(set, DCM_SoftwareVersions, EVR_LO, ProgramVersion());
  Put(set, DCM_DerivationDescription, EVR_ST, "Computed by Kinevox from several scans; not an acquisition");
  if (!series.comment.empty()) Put(set, DCM_ImageComments, EVR_LT, series.comment);
}

std::string SeriesUidOf(const Digest& content) { return UidOf(content, "series"); }

Hasher& AddOrigin(Hasher& hasher, const DicomSeries& series) {
  return hasher.Add(series.study)
      .Add(series.world)
      .Add(series.patient_id)
      .Add(series.modality)
      .Add(series.description)
      .Add(series.comment);
}

}  // namespace kvx
