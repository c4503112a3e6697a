#include "pipeline/io/dicom/dicom_series.h"

#include <algorithm>

#include "core/errors.h"
#include "pipeline/io/dicom/dicom_files.h"
#include "pipeline/io/dicom/dicom_slices.h"
#include "pipeline/io/itk_image.h"

namespace kvx {
namespace {

const char kUndecoded[] =
    "the voxels of a DICOM image are damaged, or packed in a way that is not read here; export the images "
    "again, uncompressed (Explicit VR Little Endian)";
const char kUnknownKind[] =
    "the DICOM images are of a kind (SOP class) that is not read here; convert a scan to NIfTI (dcm2niix)";

struct Series {
  std::vector<DicomFile> files;
  DicomSlices placed;
};

Series SeriesOf(std::vector<DicomFile> headers) {
  Series series{ScanFiles(std::move(headers)), {}};
  series.placed = PlaceScan(series.files);
  return series;
}

ItkPlanes PlanesOf(const DicomFile& file, bool with_values) {
  return ReadDicomPlanes(file.path, with_values, file.of_known_kind ? kUndecoded : kUnknownKind);
}

// The grid with the size in the plane, which all files must share.
Grid WholeGrid(const Series& series, const ItkPlanes& planes) {
  const Grid grid = series.placed.GridOf(planes.columns, planes.rows);
  RequirePlausible(grid, planes.type, 0);
  return grid;
}

// What the decoder leaves to do: some kinds of images it gives as they are stored.
Rescale RescaleLeft(const DicomFile& file, const ItkPlanes& planes) {
  return planes.applied.IsIdentity() ? file.rescale : Rescale{};
}

// What makes the decoder's numbers those that the file means. It inverts images that are shown so; of CT
// these are Hounsfield units all the same.
Rescale CorrectionOf(const DicomFile& file, const ItkPlanes& planes) {
  const Rescale& applied = planes.applied;
  Rescale mend;
  if (file.inverted_from && file.modality == "CT")
    mend = {-1.0, applied.slope * *file.inverted_from + 2 * applied.intercept};
  const Rescale left = RescaleLeft(file, planes);
  return {left.slope * mend.slope, left.slope * mend.intercept + left.intercept};
}

// What fractional slopes make of 16 bits comes in 64, of which 32 hold all.
ScalarType TypeOf(const DicomFile& file, const ItkPlanes& planes) {
  const ScalarType type = StoredAs(planes.type, RescaleLeft(file, planes));
  return type == ScalarType::kFloat64 ? ScalarType::kFloat32 : type;
}

void Correct(std::vector<float>& values, const Rescale& correction) {
  if (correction.IsIdentity()) return;
  for (float& value : values) value = float(correction.slope * double(value) + correction.intercept);
}

// The images of one file, each to the slice of the volume that `place_of` says.
void PutPlanes(ItkPlanes planes, const Rescale& correction, const std::vector<size_t>& place_of,
               Volume& volume) {
  const size_t plane = size_t(planes.columns) * planes.rows;
  if (planes.columns != volume.grid.size.x() || planes.rows != volume.grid.size.y() ||
      size_t(planes.count) != place_of.size()) {
    throw InputError("the images of the DICOM series differ in size; give slices of one volume only");
  }
  Correct(planes.values, correction);
  for (size_t f = 0; f < place_of.size(); ++f)
    std::copy_n(planes.values.begin() + f * plane, plane, volume.values.begin() + place_of[f] * plane);
}

// Of each file, in the order of its frames.
std::vector<std::vector<size_t>> PlacesOf(const Series& series) {
  std::vector<std::vector<size_t>> place_of(series.files.size());
  for (size_t file = 0; file < series.files.size(); ++file)
    place_of[file].resize(series.files[file].frames.size());
  for (const DicomSlice& slice : series.placed.slices) place_of[slice.file][slice.frame] = slice.plane;
  return place_of;
}

}  // namespace

Scan ReadDicomSeries(std::vector<DicomFile> headers) {
  const Series series = SeriesOf(std::move(headers));
  const ItkPlanes first = PlanesOf(series.files.front(), false);
  Scan scan;
  scan.volume = Volume(WholeGrid(series, first));
  scan.stored_as = TypeOf(series.files.front(), first);
  scan.modality = series.files.front().modality;
  const std::vector<std::vector<size_t>> place_of = PlacesOf(series);
  for (size_t f = 0; f < series.files.size(); ++f) {
    ItkPlanes planes = PlanesOf(series.files[f], true);
    if (TypeOf(series.files[f], planes) != TypeOf(series.files.front(), first))
      scan.stored_as = ScalarType::kFloat32;
    const Rescale correction = CorrectionOf(series.files[f], planes);
    PutPlanes(std::move(planes), correction, place_of[f], scan.volume);
  }
  return scan;
}

VolumeInfo ReadDicomSeriesInfo(std::vector<DicomFile> headers) {
  const Series series = SeriesOf(std::move(headers));
  const ItkPlanes first = PlanesOf(series.files.front(), false);
  return {WholeGrid(series, first), TypeOf(series.files.front(), first), series.files.front().modality};
}

}  // namespace kvx
