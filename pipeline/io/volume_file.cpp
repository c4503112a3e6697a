// Chooses the format by extension or, for a folder, DICOM.
#include "pipeline/io/volume_file.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <optional>

#include "core/errors.h"
#include "core/text/extension.h"
#include "pipeline/io/atomic_file.h"
#include "pipeline/io/dicom/dicom_files.h"
#include "pipeline/io/dicom/dicom_segments.h"
#include "pipeline/io/dicom/dicom_series.h"
#include "pipeline/io/itk_image.h"
#include "pipeline/io/nifti_file.h"
#include "pipeline/io/segment_layers.h"
#include "pipeline/io/text_header.h"
#include "pipeline/io/voxel_values.h"
#include "pipeline/io/whole_file.h"

namespace kvx {
namespace {

// Of a label that a program kept as a scaled or floating number; what is interpolated is farther off
constexpr float kMostRounding = 1e-3f;

const char kExtensions[] = ".nii, .nii.gz, .nrrd, .mha or .mhd";

std::optional<FileFormat> FormatOf(const std::filesystem::path& path) {
  if (HasExtension(path, ".nii") || HasExtension(path, ".nii.gz")) return FileFormat::kNifti;
  if (HasExtension(path, ".nrrd") || HasExtension(path, ".nhdr")) return FileFormat::kNrrd;
  if (HasExtension(path, ".mha") || HasExtension(path, ".mhd")) return FileFormat::kMeta;
  return std::nullopt;
}

bool IsLayered(const std::filesystem::path& labels) {
  return FormatOf(labels) == FileFormat::kNrrd && HoldsSegmentLayers(labels);
}

FileFormat RequireReadable(const std::filesystem::path& path) {
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(path, ignored))
    throw InputError("the volume file does not exist; check its path");
  const auto format = FormatOf(path);
  if (!format)
    throw InputError(std::string("the volume's format is not known by its extension; use ") + kExtensions +
                     ", a DICOM image of many frames (.dcm) or a folder with one DICOM series");
  return *format;
}

std::filesystem::path RawBeside(const std::filesystem::path& mhd) {
  return std::filesystem::path(mhd).replace_extension(".raw");
}

void RequireRawBeside(const std::filesystem::path& mhd) {
  const std::filesystem::path raw = RawBeside(BehindLinks(mhd));
  if (!IsNameable(raw.filename().string())) {
    throw InputError(
        "a .mhd file cannot name its .raw file where the name holds % or a line break, or begins with LIST "
        "or a space; choose another name, or .mha");
  }
  std::error_code ignored;
  if (std::filesystem::exists(raw, ignored) && !std::filesystem::exists(mhd, ignored)) {
    throw InputError(
        "the voxels of a .mhd file go into a .raw file of its name, and such a file is there already, "
        "without a .mhd; choose another name, or remove it");
  }
}

FileFormat RequireWritable(const std::filesystem::path& path) {
  const auto format = FormatOf(path);
  if (!format || HasExtension(path, ".nhdr")) {
    throw InputError(std::string("the output's format is not known by its extension; use ") + kExtensions);
  }
  if (HasExtension(path, ".mhd")) RequireRawBeside(path);
  return *format;
}

// A .mhd is a .mha in two files; ITK would name the second one after our temporary file.
void SplitMeta(const std::filesystem::path& mha, const std::filesystem::path& mhd) {
  const std::string bytes = WholeFile(mha);
  const size_t at = bytes.find(kVoxelsFollow);
  if (at == std::string::npos) throw Unavailable("a volume cannot be written; is the disk full?");
  const std::filesystem::path raw = RawBeside(mhd);
  WriteFileAtomically(raw, std::string_view(bytes).substr(at + kVoxelsFollow.size()));
  WriteFileAtomically(mhd, bytes.substr(0, at) + "ElementDataFile = " + raw.filename().string() + "\n");
}

void Write(const std::filesystem::path& named, const Grid& grid, ScalarType type, int components,
           const std::string& bytes) {
  const FileFormat format = RequireWritable(named);
  const bool detached = HasExtension(named, ".mhd");
  // Behind a link the voxels lie beside the file, not beside the link
  const std::filesystem::path path = detached ? BehindLinks(named) : named;
  AtomicFile file(detached ? std::filesystem::path(path).replace_extension(".mha") : path);
  const bool compressed = format == FileFormat::kNrrd || HasExtension(path, ".gz");
  WriteItk(format, file.temporary(), grid, type, components, bytes, compressed);
  if (detached) {
    SplitMeta(file.temporary(), path);
  } else {
    file.Commit();
  }
}

// As it is stored, "not a number" among its values.
Scan ReadStored(const std::filesystem::path& path) {
  if (HoldsDicom(path)) return ReadDicomSeries(ReadDicomHeaders(path));
  const FileFormat format = RequireReadable(path);
  return format == FileFormat::kNifti ? ReadNifti(path) : ReadItkScan(format, path);
}

// Of voxels that are the labels.
LabelMap NumbersOf(Scan scan) {
  FillUnmeasured(scan.volume.values, 0);
  LabelMap labels(scan.volume.grid);
  for (size_t v = 0; v < labels.values.size(); ++v) {
    const float value = scan.volume.values[v], whole = std::round(value);
    if (!(whole >= 0 && whole <= 65535) || std::abs(value - whole) > kMostRounding) {
      throw InputError(
          "the label map holds values that are not whole numbers from 0 to 65535; is it a label map?");
    }
    labels.values[v] = uint16_t(whole);
  }
  return labels;
}

}  // namespace

std::filesystem::path DetachedData(const std::filesystem::path& path) {
  if (!HasExtension(path, ".nhdr") && !HasExtension(path, ".mhd")) return {};
  const TextHeader header = ReadTextHeader(*FormatOf(path), path);
  return header.attached ? std::filesystem::path() : header.voxels;
}

void RequireWritableExtension(const std::filesystem::path& path) { RequireWritable(path); }

bool HoldsDicom(const std::filesystem::path& path) {
  std::error_code ignored;
  return std::filesystem::is_directory(path, ignored) ||
         (std::filesystem::is_regular_file(path, ignored) && HasExtension(path, ".dcm"));
}

Scan ReadScan(const std::filesystem::path& path) {
  Scan scan = ReadStored(path);
  FillUnmeasured(scan.volume.values, SmallestMeasured(scan.volume.values));
  return scan;
}

VolumeInfo ReadVolumeInfo(const std::filesystem::path& path) {
  if (HoldsDicom(path)) return ReadDicomSeriesInfo(ReadDicomHeaders(path));
  const FileFormat format = RequireReadable(path);
  if (format == FileFormat::kNifti) return ReadNiftiInfo(path);
  const ItkHeader header = ReadItkHeader(format, path);
  return {header.grid, StoredAs(header.type, header.rescale), ""};
}

Grid ReadLabelsGrid(const std::filesystem::path& path) {
  if (!HoldsDicom(path)) return IsLayered(path) ? SegmentLayersGrid(path) : ReadVolumeInfo(path).grid;
  std::vector<DicomFile> headers = ReadDicomHeaders(path);
  if (const auto grid = FindDicomSegmentsGrid(headers)) return *grid;
  return ReadDicomSeriesInfo(std::move(headers)).grid;
}

LayeredLabels ReadLayeredLabels(const std::filesystem::path& path) {
  if (IsLayered(path)) return ReadSegmentLayers(path);
  if (!HoldsDicom(path)) return {NumbersOf(ReadStored(path)), {}};
  std::vector<DicomFile> headers = ReadDicomHeaders(path);
  if (auto segments = FindDicomSegments(headers)) return *std::move(segments);
  return {NumbersOf(ReadDicomSeries(std::move(headers))), {}};
}

LabelMap ReadLabels(const std::filesystem::path& path) { return ReadLayeredLabels(path).labels; }

void WriteVolume(const std::filesystem::path& path, const Volume& volume, ScalarType type) {
  Write(path, volume.grid, type, 1, Packed(type, volume.values));
}

void WriteLabels(const std::filesystem::path& path, const LabelMap& labels) {
  const bool small =
      std::all_of(labels.values.begin(), labels.values.end(), [](uint16_t l) { return l < 256; });
  const std::vector<float> values(labels.values.begin(), labels.values.end());
  const ScalarType type = small ? ScalarType::kUint8 : ScalarType::kUint16;
  Write(path, labels.grid, type, 1, Packed(type, values));
}

void WriteField(const std::filesystem::path& path, const DisplacementField& field) {
  const auto* bytes = reinterpret_cast<const char*>(field.values.data());
  Write(path, field.grid, ScalarType::kFloat32, 3,
        std::string(bytes, field.values.size() * sizeof(Eigen::Vector3f)));
}

}  // namespace kvx
