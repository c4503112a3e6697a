// Attributes: DICOM PS3.3, A.3 (CT), A.4 (MR), A.8.1 (secondary capture).
#include "pipeline/io/dicom/dicom_writer.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "core/errors.h"
#include "pipeline/io/dicom/dicom_elements.h"
#include "pipeline/io/zip_file.h"

namespace kvx {
namespace {

constexpr float kFullScale = 32767;
constexpr double kLevelsEnough = 1000;  // of values without end: more than a screen shows

const char kNotFinite[] = "a volume with values that are not finite cannot be DICOM";

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
  DcmItem& map = AddItem(set, DCM_RealWorldValueMappingSequence);
  Require(map.putAndInsertSint16(DcmTag(DCM_RealWorldValueFirstValueMapped, EVR_SS), -32767));
  Require(map.putAndInsertSint16(DcmTag(DCM_RealWorldValueLastValueMapped, EVR_SS), 32767));
  Require(map.putAndInsertFloat64(DcmTag(DCM_RealWorldValueIntercept, EVR_FD), 0));
  Require(map.putAndInsertFloat64(DcmTag(DCM_RealWorldValueSlope, EVR_FD), step));
  Put(map, DCM_LUTExplanation, EVR_LO, "intensity as in the scans");
  Put(map, DCM_LUTLabel, EVR_SH, "intensity");
  PutCode(map, DCM_MeasurementUnitsCodeSequence, {"UCUM", "1", "no units"});
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
  Put(set, DCM_InstanceNumber, EVR_IS, std::to_string(k + 1));
  Put(set, DCM_PatientOrientation, EVR_CS, "");
  PutPosition(set, grid, k);
  PutOrientation(set, grid);
  PutPixelSpacing(set, grid);
  Put(set, DCM_SliceThickness, EVR_DS, Decimal(grid.spacing_mm.z()));
  PutPixels(set, grid, 16, true);
}

std::string ImageUidOf(const Digest& content, int k) { return UidOf(content, "image", k); }

std::string ImageBytes(const Grid& grid, int k, const Sint16* stored, const DicomGreys& greys,
                       const DicomSeries& series, const Digest& content) {
  DcmFileFormat file;
  DcmItem& set = *file.getDataset();
  Put(set, DCM_SOPClassUID, EVR_UI, SopClassOf(series.modality));
  Put(set, DCM_SOPInstanceUID, EVR_UI, ImageUidOf(content, k));
  PutOrigin(set, series, content);
  PutModality(set, series.modality);
  PutPlane(set, grid, k);
  PutValues(set, series.modality, greys);
  const size_t pixels = size_t(grid.size.x()) * size_t(grid.size.y());
  Require(set.putAndInsertUint16Array(DcmTag(DCM_PixelData, EVR_OW), reinterpret_cast<const Uint16*>(stored),
                                      pixels));
  return FileBytes(file);
}

Digest ContentOf(const Volume& volume, const std::vector<Sint16>& stored, const DicomGreys& greys,
                 const DicomSeries& series) {
  Hasher hasher;
  hasher.Add(greys.step).Add(int64_t(greys.window_low)).Add(int64_t(greys.window_high));
  AddOrigin(hasher, series);
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

DicomImages ImagesOf(const Volume& volume, const DicomGreys& greys, const DicomSeries& series) {
  const Digest content = ContentOf(volume, Stored(volume, greys.step), greys, series);
  DicomImages of{SopClassOf(series.modality), SeriesUidOf(content), {}};
  for (int k = 0; k < volume.grid.size.z(); ++k) of.images.push_back(ImageUidOf(content, k));
  return of;
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
