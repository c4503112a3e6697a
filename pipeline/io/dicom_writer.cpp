// By DCMTK. Value representations are named with every tag, so no data dictionary is needed at run time.
// Attributes: DICOM PS3.3, A.3 (CT), A.4 (MR), A.8.1 (secondary capture).
#include "pipeline/io/dicom_writer.h"

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcostrmb.h>
#include <dcmtk/dcmdata/dctk.h>

#include <algorithm>
#include <cmath>
#include <span>

#include "core/errors.h"
#include "core/version.h"
#include "pipeline/io/zip_file.h"

namespace kvx {
namespace {

constexpr float kFullScale = 32767;
constexpr double kLevelsEnough = 1000;  // of values without end: more than a screen shows

const char kNotFinite[] = "a volume with values that are not finite cannot be DICOM";

void Require(const OFCondition& done) {
  if (done.bad()) throw Unavailable("a DICOM image cannot be made; is there memory left?");
}

void Put(DcmItem& item, const DcmTagKey& key, DcmEVR vr, const std::string& value) {
  Require(item.putAndInsertString(DcmTag(key, vr), value.c_str()));
}

void Put(DcmItem& item, const DcmTagKey& key, int value) {
  Require(item.putAndInsertUint16(DcmTag(key, EVR_US), Uint16(value)));
}

// At most 16 letters, as DS asks for.
std::string Decimal(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.10g", value == 0 ? 0.0 : value);
  return text;
}

std::string Decimals(std::initializer_list<double> values) {
  std::string text;
  for (const double value : values) text += (text.empty() ? "" : "\\") + Decimal(value);
  return text;
}

// A UUID of version 8 (RFC 9562) out of the digest, as PS3.5 B.2 writes it.
std::string UidOf(const Digest& digest, std::string_view what, int number = 0) {
  Digest bits = Hasher().Add(digest).Add(what).Add(int64_t(number)).Finish();
  bits.bytes[6] = (bits.bytes[6] & 0x0f) | 0x80;
  bits.bytes[8] = (bits.bytes[8] & 0x3f) | 0x80;
  unsigned __int128 value = 0;
  for (int b = 0; b < 16; ++b) value = value << 8 | bits.bytes[b];
  std::string digits;
  for (; value; value /= 10) digits.insert(digits.begin(), char('0' + int(value % 10)));
  return "2.25." + digits;
}

// Two patients share none, though they may have the same scans.
std::string UidOf(const DicomSeries& series, const Digest& digest, std::string_view what) {
  return UidOf(Hasher().Add(digest).Add(series.patient_id).Finish(), what);
}

// The least of 1, 2, 5 times a power of ten that brings `largest` into 16 bits, or half a step beyond.
double StepFor(float largest) {
  const double decade = std::pow(10, std::floor(std::log10(double(largest) / kFullScale)));
  for (const double digit : {1.0, 2.0, 5.0})
    if (largest <= digit * decade * (kFullScale + 0.5)) return digit * decade;
  return 10 * decade;
}

double StepOf(const Scan& of_template) {
  const auto [least, most] = std::ranges::minmax(of_template.volume.values);
  if (!std::isfinite(least) || !std::isfinite(most)) throw InputError(kNotFinite);
  const float largest = std::max(std::abs(least), std::abs(most));
  const ScalarType type = of_template.stored_as;
  const bool whole = type != ScalarType::kFloat32 && type != ScalarType::kFloat64;
  const bool many = double(most) - double(least) >= kLevelsEnough;
  if (largest == 0 || (largest <= kFullScale && (whole || many))) return 1;
  return StepFor(largest);
}

// Halves go to the even number, as in the other formats.
std::vector<Sint16> Stored(const Volume& volume, double step) {
  std::vector<Sint16> stored(volume.values.size());
  for (size_t v = 0; v < stored.size(); ++v) {
    if (!std::isfinite(volume.values[v])) throw InputError(kNotFinite);
    stored[v] = Sint16(std::clamp(std::nearbyint(volume.values[v] / step), -32767.0, 32767.0));
  }
  return stored;
}

// All but the darkest and brightest hundredth.
void ChooseWindow(const std::vector<Sint16>& stored, DicomGreys& greys) {
  std::vector<size_t> count(65536);
  for (const Sint16 value : stored) ++count[size_t(value + 32768)];
  const size_t cut = stored.size() / 100;
  size_t low = 0, high = 65535;
  for (size_t sum = count[low]; sum <= cut && low < high; sum += count[++low]) {
  }
  for (size_t sum = count[high]; sum <= cut && high > low; sum += count[--high]) {
  }
  greys.window_low = int(low) - 32768;
  greys.window_high = std::max(int(high) - 32768, greys.window_low + 1);
}

const char* SopClassOf(const std::string& modality) {
  if (modality == "MR") return UID_MRImageStorage;
  return modality == "CT" ? UID_CTImageStorage : UID_SecondaryCaptureImageStorage;
}

// Not zero. Series of a study seldom have the same: archives list and sort by it.
int SeriesNumberOf(const Digest& content) {
  constexpr int kMost = 999999;
  int number = 0;
  for (int b = 0; b < 3; ++b) number = number << 8 | content.bytes[b];
  return 1 + number % kMost;
}

void PutOrigin(DcmItem& set, const DicomSeries& series, const Digest& content) {
  const bool known = series.modality == "MR" || series.modality == "CT";
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
  Put(set, DCM_Modality, EVR_CS, known ? series.modality : "OT");
  Put(set, DCM_SeriesInstanceUID, EVR_UI, UidOf(content, "series"));
  Put(set, DCM_SeriesNumber, EVR_IS, std::to_string(SeriesNumberOf(content)));
  Put(set, DCM_SeriesDescription, EVR_LO, series.description);
  Put(set, DCM_Laterality, EVR_CS, "");
  Put(set, DCM_PatientPosition, EVR_CS, "");
  Put(set, DCM_FrameOfReferenceUID, EVR_UI, UidOf(series, series.world, "frame of reference"));
  Put(set, DCM_PositionReferenceIndicator, EVR_LO, "");
  Put(set, DCM_Manufacturer, EVR_LO, "Kinevox");
  Put(set, DCM_SoftwareVersions, EVR_LO, ProgramVersion());
  Put(set, DCM_DerivationDescription, EVR_ST, "Computed by Kinevox from several scans; not an acquisition");
  if (!series.comment.empty()) Put(set, DCM_ImageComments, EVR_LT, series.comment);
}

void PutModality(DcmItem& set, const std::string& modality) {
  if (modality == "MR") {
    Put(set, DCM_ImageType, EVR_CS, "DERIVED\\SECONDARY\\OTHER");
    Put(set, DCM_ScanningSequence, EVR_CS, "RM");
    Put(set, DCM_SequenceVariant, EVR_CS, "NONE");
    Put(set, DCM_ScanOptions, EVR_CS, "");
    Put(set, DCM_MRAcquisitionType, EVR_CS, "");
    Put(set, DCM_RepetitionTime, EVR_DS, "");
    Put(set, DCM_EchoTime, EVR_DS, "");
    Put(set, DCM_EchoTrainLength, EVR_IS, "");
  } else if (modality == "CT") {
    Put(set, DCM_ImageType, EVR_CS, "DERIVED\\SECONDARY\\AXIAL");
    Put(set, DCM_KVP, EVR_DS, "");
    Put(set, DCM_AcquisitionNumber, EVR_IS, "");
  } else {
    Put(set, DCM_ImageType, EVR_CS, "DERIVED\\SECONDARY");
    Put(set, DCM_ConversionType, EVR_CS, "WSD");
  }
}

// What the standard has for MR images. It is of stored values, as the rescale slope is: they do not add up.
void PutRealWorldValues(DcmItem& set, double step) {
  DcmItem *map = nullptr, *unit = nullptr;
  Require(set.findOrCreateSequenceItem(DcmTag(DCM_RealWorldValueMappingSequence, EVR_SQ), map));
  Require(map->putAndInsertSint16(DcmTag(DCM_RealWorldValueFirstValueMapped, EVR_SS), -32767));
  Require(map->putAndInsertSint16(DcmTag(DCM_RealWorldValueLastValueMapped, EVR_SS), 32767));
  Require(map->putAndInsertFloat64(DcmTag(DCM_RealWorldValueIntercept, EVR_FD), 0));
  Require(map->putAndInsertFloat64(DcmTag(DCM_RealWorldValueSlope, EVR_FD), step));
  Put(*map, DCM_LUTExplanation, EVR_LO, "intensity as in the scans");
  Put(*map, DCM_LUTLabel, EVR_SH, "intensity");
  Require(map->findOrCreateSequenceItem(DcmTag(DCM_MeasurementUnitsCodeSequence, EVR_SQ), unit));
  Put(*unit, DCM_CodeValue, EVR_SH, "1");
  Put(*unit, DCM_CodingSchemeDesignator, EVR_SH, "UCUM");
  Put(*unit, DCM_CodeMeaning, EVR_LO, "no units");
}

// A rescale slope is no part of the standard's MR image, but is what nearly all readers apply to one; with it
// the image is of a standard extended class, as those of many scanners are. It is left out where it is 1.
void PutValues(DcmItem& set, const std::string& modality, const DicomGreys& greys) {
  const bool plain = modality == "MR" && greys.step == 1;
  if (modality == "MR" && !plain) PutRealWorldValues(set, greys.step);
  if (!plain) {
    Put(set, DCM_RescaleIntercept, EVR_DS, "0");
    Put(set, DCM_RescaleSlope, EVR_DS, Decimal(greys.step));
    Put(set, DCM_RescaleType, EVR_LO, modality == "CT" ? "HU" : "US");
  }
  const double low = greys.step * greys.window_low, high = greys.step * greys.window_high;  // rescaled
  Put(set, DCM_WindowCenter, EVR_DS, Decimal(0.5 * (low + high)));
  Put(set, DCM_WindowWidth, EVR_DS, Decimal(high - low));
  Put(set, DCM_VOILUTFunction, EVR_CS, "LINEAR_EXACT");  // a width below 1 is none by the usual function
}

void PutPlane(DcmItem& set, const Grid& grid, int k) {
  const Eigen::Vector3d at = grid.ToMm(0, 0, k).lps, right = grid.direction.col(0),
                        down = grid.direction.col(1);
  Put(set, DCM_InstanceNumber, EVR_IS, std::to_string(k + 1));
  Put(set, DCM_PatientOrientation, EVR_CS, "");
  Put(set, DCM_ImagePositionPatient, EVR_DS, Decimals({at.x(), at.y(), at.z()}));
  Put(set, DCM_ImageOrientationPatient, EVR_DS,
      Decimals({right.x(), right.y(), right.z(), down.x(), down.y(), down.z()}));
  Put(set, DCM_PixelSpacing, EVR_DS, Decimals({grid.spacing_mm.y(), grid.spacing_mm.x()}));  // rows first
  Put(set, DCM_SliceThickness, EVR_DS, Decimal(grid.spacing_mm.z()));
  Put(set, DCM_SamplesPerPixel, 1);
  Put(set, DCM_PhotometricInterpretation, EVR_CS, "MONOCHROME2");
  Put(set, DCM_Rows, grid.size.y());
  Put(set, DCM_Columns, grid.size.x());
  Put(set, DCM_BitsAllocated, 16);
  Put(set, DCM_BitsStored, 16);
  Put(set, DCM_HighBit, 15);
  Put(set, DCM_PixelRepresentation, 1);
}

std::string FileBytes(DcmFileFormat& file, size_t pixel_bytes) {
  std::string bytes(pixel_bytes + 65536, '\0');
  DcmOutputBufferStream out(bytes.data(), offile_off_t(bytes.size()));
  file.transferInit();
  Require(file.write(out, EXS_LittleEndianExplicit, EET_ExplicitLength, nullptr));
  file.transferEnd();
  bytes.resize(size_t(out.filled()));
  return bytes;
}

std::string ImageBytes(const Grid& grid, int k, const Sint16* stored, const DicomGreys& greys,
                       const DicomSeries& series, const Digest& content) {
  DcmFileFormat file;
  DcmItem& set = *file.getDataset();
  Put(set, DCM_SOPClassUID, EVR_UI, SopClassOf(series.modality));
  Put(set, DCM_SOPInstanceUID, EVR_UI, UidOf(content, "image", k));
  PutOrigin(set, series, content);
  PutModality(set, series.modality);
  PutPlane(set, grid, k);
  PutValues(set, series.modality, greys);
  const size_t pixels = size_t(grid.size.x()) * size_t(grid.size.y());
  Require(set.putAndInsertUint16Array(DcmTag(DCM_PixelData, EVR_OW), reinterpret_cast<const Uint16*>(stored),
                                      pixels));
  return FileBytes(file, 2 * pixels);
}

Digest ContentOf(const Volume& volume, const std::vector<Sint16>& stored, const DicomGreys& greys,
                 const DicomSeries& series) {
  Hasher hasher;
  hasher.Add(greys.step).Add(int64_t(greys.window_low)).Add(int64_t(greys.window_high));
  hasher.Add(series.study)
      .Add(series.world)
      .Add(series.patient_id)
      .Add(series.modality)
      .Add(series.description)
      .Add(series.comment);
  for (const double number : volume.grid.direction.reshaped()) hasher.Add(number);
  for (const double number : volume.grid.spacing_mm) hasher.Add(number);
  for (const double number : volume.grid.origin.lps) hasher.Add(number);
  for (const int number : volume.grid.size) hasher.Add(int64_t(number));
  return hasher.Raw(std::as_bytes(std::span(stored))).Finish();
}

}  // namespace

DicomGreys DicomGreysOf(const Scan& of_template) {
  DicomGreys greys{.step = StepOf(of_template)};
  ChooseWindow(Stored(of_template.volume, greys.step), greys);
  return greys;
}

void WriteDicomZip(const std::filesystem::path& path, const Volume& volume, const DicomGreys& greys,
                   const DicomSeries& series) {
  const Grid& grid = volume.grid;
  if (grid.size.maxCoeff() > 65535)
    throw InputError("a volume with more than 65535 voxels along an axis cannot be DICOM");
  const std::vector<Sint16> stored = Stored(volume, greys.step);
  const Digest content = ContentOf(volume, stored, greys, series);
  ZipFile zip(path);
  const size_t plane = size_t(grid.size.x()) * size_t(grid.size.y());
  for (int k = 0; k < grid.size.z(); ++k) {
    char name[32];
    std::snprintf(name, sizeof name, "image%05d.dcm", k + 1);
    zip.Add(name, ImageBytes(grid, k, stored.data() + size_t(k) * plane, greys, series, content));
  }
  zip.Commit();
}

}  // namespace kvx
