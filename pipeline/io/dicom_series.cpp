// Slices are ordered by their place along the common normal, never by file name or instance number. Exports
// of whole studies hold localisers, screenshots, segmentations and doses beside the volume; these do not
// count.
#include "pipeline/io/dicom_series.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <map>
#include <set>

#include "core/digest.h"
#include "core/errors.h"
#include "core/text/listed.h"
#include "pipeline/io/dicom_axes.h"
#include "pipeline/io/dicom_header.h"
#include "pipeline/io/itk_image.h"
#include "pipeline/io/series_folder.h"

namespace kvx {
namespace {

constexpr size_t kMostPlanes = 100'000;
constexpr double kSlackMm = 1e-6;     // of sums of decimal numbers
constexpr double kMostAstray = 0.25;  // of a voxel, of any slice from its place in the grid
const char kUneven[] =
    "the slices of the DICOM series are unevenly spaced; resample them to one spacing and save as NIfTI";
const char kUndecoded[] =
    "the voxels of a DICOM image are damaged, or packed in a way that is not read here; export the images "
    "again, uncompressed (Explicit VR Little Endian)";
const char kUnknownKind[] =
    "the DICOM images are of a kind (SOP class) that is not read here; convert a scan to NIfTI (dcm2niix), "
    "and save a segmentation as .nii.gz or .nrrd";

struct Slice {
  size_t file = 0, frame = 0;
  DicomFrame place;
  double along_normal_mm = 0;
  size_t plane = 0;  // of the grid
};

struct Series {
  std::vector<DicomFile> files;
  std::vector<Slice> slices;  // by place along the normal
  Grid grid;                  // without the size in the plane
};

std::string Count(size_t n, const std::string& what) { return std::to_string(n) + " " + what; }

bool Turned(const DicomFrame& a, const DicomFrame& b) {
  return std::max((a.along_row - b.along_row).norm(), (a.along_column - b.along_column).norm()) > 1e-3;
}

// Not for what is damaged: beside such a series no other may be taken for the one that is meant.
bool IsNoVolume(const std::vector<DicomFile>& series) {
  if (std::ranges::all_of(series, &DicomFile::localiser)) return true;
  if (std::ranges::all_of(series, &DicomFile::coloured)) return true;
  std::vector<DicomFrame> frames;
  for (const DicomFile& file : series) frames.insert(frames.end(), file.frames.begin(), file.frames.end());
  return frames.size() < 2 ||
         std::ranges::any_of(frames, [&](const DicomFrame& frame) { return Turned(frames[0], frame); });
}

size_t Images(const std::vector<DicomFile>& series) {
  size_t count = 0;
  for (const DicomFile& file : series) count += std::max<size_t>(1, file.frames.size());
  return count;
}

bool Holds(const std::vector<DicomFile>& files, DicomContent content) {
  return std::ranges::any_of(files, [=](const DicomFile& file) { return file.content == content; });
}

// Of all files those that may be what is asked for.
std::vector<DicomFile> Meant(std::vector<DicomFile> files, DicomUse use) {
  if (files.empty())
    throw InputError("the folder holds no DICOM images; give a folder with one DICOM series");
  const bool segments = Holds(files, DicomContent::kSegments);
  const DicomContent meant =
      use == DicomUse::kLabels && segments ? DicomContent::kSegments : DicomContent::kBody;
  std::erase_if(files, [=](const DicomFile& file) { return file.content != meant; });
  if (!files.empty()) return files;
  if (segments) {
    throw InputError(
        "the DICOM images are a segmentation (SEG) and no scan; give the MR or CT series that it was drawn "
        "on, and the segmentation, saved as .nii.gz or .nrrd, as the label map of its bones");
  }
  throw InputError(
      "the DICOM images are doses, parametric maps, images of a treatment or the like and no scan; give the "
      "series of an MR or CT volume");
}

void RequireOneSegment(const std::vector<DicomFile>& series) {
  for (const DicomFile& file : series) {
    if (file.segments < 2) continue;
    throw InputError("the DICOM segmentation (SEG) holds " +
                     Count(file.segments,
                           "segments, each in frames of its own; save it as one label map with a number for "
                           "each (.nii.gz, .nrrd), as 3D Slicer does, or as a folder with a mask for each"));
  }
}

// Of several the only one that may be a volume.
std::vector<DicomFile> TheSeries(std::vector<DicomFile> files) {
  std::map<std::string, std::vector<DicomFile>> all;
  for (DicomFile& file : files) all[file.series].push_back(std::move(file));
  const size_t count = all.size();
  if (count == 1) return std::move(all.begin()->second);
  std::erase_if(all, [](const auto& series) { return IsNoVolume(series.second); });
  if (all.empty()) {
    throw InputError(
        "the folder holds " +
        Count(count,
              "DICOM series, none of which is a volume (localisers, single images, colours); give "
              "a folder with the series of one MR or CT volume"));
  }
  if (all.size() == 1) return std::move(all.begin()->second);
  const std::string images =
      Listed(all, [](const auto& series) { return std::to_string(Images(series.second)); });
  throw InputError("the folder holds " + Count(all.size(), "DICOM series that may be volumes (of ") + images +
                   " images); put the one you mean in a folder of its own");
}

// A folder into which a slice was copied twice: archives drop the second, too. Files at one place of one size
// are looked at whole.
std::vector<DicomFile> WithoutCopies(std::vector<DicomFile> series) {
  const auto place_of = [](const DicomFile& file) {
    std::array<double, 4> place{double(file_size(file.path))};
    if (!file.frames.empty()) Eigen::Vector3d::Map(&place[1]) = file.frames.front().position_mm;
    return place;
  };
  std::map<std::array<double, 4>, int> files_at;
  for (const DicomFile& file : series) ++files_at[place_of(file)];
  std::set<Digest> seen;
  std::erase_if(series, [&](const DicomFile& file) {
    if (files_at[place_of(file)] < 2) return false;
    std::ifstream bytes(file.path, std::ios::binary);
    return !seen.insert(Sha256(bytes)).second;
  });
  return series;
}

void RequireOneVolume(const std::vector<DicomFile>& series) {
  RequireOneSegment(series);
  if (std::ranges::any_of(series, [](const DicomFile& file) { return file.frames.empty(); })) {
    throw InputError(
        "the DICOM images do not say where they lie in the patient (position, orientation or pixel spacing "
        "is missing); give a series of slices of an MR or CT volume");
  }
  if (std::ranges::any_of(series, &DicomFile::coloured)) {
    throw InputError(
        "the DICOM images hold colours and are no scan; give the series of an MR or CT volume, with one grey "
        "value per voxel");
  }
  std::set<std::string> echoes;
  for (const DicomFile& file : series) echoes.insert(file.echo);
  if (echoes.size() > 1) {
    throw InputError("the DICOM series holds " +
                     Count(echoes.size(),
                           "echoes, each a volume; put the images of the one you mean in a "
                           "folder of their own"));
  }
}

void RequireSamePlane(const DicomFrame& a, const DicomFrame& b) {
  if (Turned(a, b)) {
    throw InputError(
        "the slices of the DICOM series are turned against each other (a localiser?); give parallel slices "
        "only");
  }
  if ((a.spacing_mm - b.spacing_mm).norm() > 1e-4 * a.spacing_mm.norm()) {
    throw InputError(
        "the slices of the DICOM series have different pixel spacings; give slices of one volume only");
  }
}

// Positions that an exporter rounded to a tenth of a millimetre make steps differ by as much. A fifth of a
// step is a tenth of a voxel for each of its slices: less than interpolation blurs. (dcm2niix takes 0.2 mm
// for equal; ITK warns and takes the mean.)
double StepTolerance(double mean_mm) { return std::max(0.02 * mean_mm, std::min(0.1, 0.2 * mean_mm)); }

std::vector<double> StepsOf(const std::vector<Slice>& slices) {
  std::vector<double> steps;
  for (size_t s = 1; s < slices.size(); ++s)
    steps.push_back(slices[s].along_normal_mm - slices[s - 1].along_normal_mm);
  if (std::ranges::min(steps) >= 0.01) return steps;
  throw InputError(
      "several slices of the DICOM series lie at the same place (time frames or a second volume); put the "
      "images of one volume in a folder of their own");
}

// Every step between neighbours must be the same.
double RegularStep(std::vector<Slice>& slices) {
  const std::vector<double> steps = StepsOf(slices);
  const auto [least, most] = std::ranges::minmax(steps);
  for (size_t s = 0; s < slices.size(); ++s) slices[s].plane = s;
  const double mean = (slices.back().along_normal_mm - slices.front().along_normal_mm) / double(steps.size());
  const double tolerance_mm = StepTolerance(mean) + kSlackMm;
  if (most - mean <= tolerance_mm && mean - least <= tolerance_mm) return mean;
  if (most <= 1.5 * least) throw InputError(kUneven);
  throw InputError(
      "a slice of the DICOM series is missing or the gaps between slices differ; export the whole series "
      "again");
}

// Planes in which a segment has nothing are mostly left out of its file: a step is one plane or more.
double PlaneStep(std::vector<Slice>& slices, double said_mm) {
  const std::vector<double> steps = StepsOf(slices);
  const double least = std::ranges::min(steps), of_least = said_mm > 0 ? std::round(least / said_mm) : 0;
  const bool as_said = of_least >= 1 && std::abs(least - of_least * said_mm) <= StepTolerance(said_mm);
  const double about_mm = as_said ? said_mm : least;
  for (size_t s = 1; s < slices.size(); ++s) {
    slices[s].plane = slices[s - 1].plane + size_t(std::round(steps[s - 1] / about_mm));
    if (slices[s].plane > kMostPlanes) throw InputError(kUneven);
  }
  const double step_mm =
      (slices.back().along_normal_mm - slices.front().along_normal_mm) / double(slices.back().plane);
  for (size_t s = 1; s < slices.size(); ++s) {
    const double planes = double(slices[s].plane - slices[s - 1].plane);
    if (std::abs(steps[s - 1] - planes * step_mm) > StepTolerance(step_mm) + kSlackMm)
      throw InputError(kUneven);
  }
  return step_mm;
}

// A step's rounding is no harm, but steps add up: every slice must lie where the grid has it.
void RequireStraight(const std::vector<Slice>& slices, const Eigen::Vector3d& normal, double step_mm) {
  const double in_plane_mm = kMostAstray * slices.front().place.spacing_mm.minCoeff();
  for (size_t s = 1; s < slices.size(); ++s) {
    const Eigen::Vector3d from_first = slices[s].place.position_mm - slices.front().place.position_mm;
    const double along_mm = from_first.dot(normal);
    if ((from_first - normal * along_mm).norm() > in_plane_mm) {
      throw InputError(
          "the slices of the DICOM series are shifted against each other, by more than a quarter of a voxel "
          "in all (gantry tilt); straighten them (dcm2niix does, and writes NIfTI) or export the series "
          "reformatted at right angles");
    }
    if (std::abs(along_mm - double(slices[s].plane) * step_mm) > kMostAstray * step_mm)
      throw InputError(kUneven);
  }
}

void SortAlong(const Eigen::Vector3d& normal, std::vector<Slice>& slices) {
  for (Slice& slice : slices) slice.along_normal_mm = normal.dot(slice.place.position_mm);
  std::ranges::stable_sort(slices, {}, &Slice::along_normal_mm);
}

void PlaceSlices(Series& series) {
  const DicomFrame& first = series.files.front().frames.front();
  for (size_t file = 0; file < series.files.size(); ++file) {
    for (size_t frame = 0; frame < series.files[file].frames.size(); ++frame) {
      const DicomFrame& place = series.files[file].frames[frame];
      RequireSamePlane(first, place);
      series.slices.push_back({file, frame, place});
    }
  }
  if (!(first.spacing_mm.minCoeff() > 0)) {
    throw InputError(
        "the DICOM series gives a pixel spacing that is not a positive number; export it again or convert it "
        "to NIfTI");
  }
  std::vector<Slice>& slices = series.slices;
  if (slices.size() < 2)
    throw InputError("the DICOM series holds a single slice; give a series of a whole volume");
  SortAlong(first.along_row.cross(first.along_column).normalized(), slices);
  series.grid.direction = AxesOf(first, slices.back().place.position_mm - slices.front().place.position_mm);
  const Eigen::Vector3d normal = series.grid.direction.col(2);
  SortAlong(normal, slices);
  const DicomFile& file = series.files.front();
  const double step_mm =
      file.content == DicomContent::kSegments ? PlaneStep(slices, file.between_mm) : RegularStep(slices);
  RequireStraight(slices, normal, step_mm);
  series.grid.spacing_mm << first.spacing_mm, step_mm;
  series.grid.origin.lps = slices.front().place.position_mm;
}

Series OpenSeries(const std::filesystem::path& path, DicomUse use) {
  std::vector<DicomFile> files;
  const bool folder = std::filesystem::is_directory(path);
  for (const std::filesystem::path& file :
       folder ? SeriesFiles(path) : std::vector<std::filesystem::path>{path}) {
    if (auto header = ReadDicomHeader(file)) files.push_back(*std::move(header));
  }
  Series series{WithoutCopies(TheSeries(Meant(std::move(files), use))), {}, {}};
  RequireOneVolume(series.files);
  PlaceSlices(series);
  return series;
}

ItkPlanes PlanesOf(const DicomFile& file, bool with_values) {
  return ReadDicomPlanes(file.path, with_values, file.of_known_kind ? kUndecoded : kUnknownKind);
}

// The grid with the size in the plane, which all files must share.
Grid WholeGrid(const Series& series, const ItkPlanes& planes) {
  Grid grid = series.grid;
  grid.size = {planes.columns, planes.rows, int(series.slices.back().plane) + 1};
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
  if (file.of_bits) return {1.0 / 255, 0};
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

// A probability is inside from a half on.
void TakeHalves(const DicomFile& file, std::vector<float>& values) {
  if (file.certain == 0) return;
  for (float& value : values) value = 2 * value >= float(file.certain) ? 1.0f : 0.0f;
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
  for (const Slice& slice : series.slices) place_of[slice.file][slice.frame] = slice.plane;
  return place_of;
}

}  // namespace

Scan ReadDicomSeries(const std::filesystem::path& path, DicomUse use) {
  const Series series = OpenSeries(path, use);
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
    TakeHalves(series.files[f], planes.values);
    const Rescale correction = CorrectionOf(series.files[f], planes);
    PutPlanes(std::move(planes), correction, place_of[f], scan.volume);
  }
  return scan;
}

VolumeInfo ReadDicomSeriesInfo(const std::filesystem::path& path, DicomUse use) {
  const Series series = OpenSeries(path, use);
  const ItkPlanes first = PlanesOf(series.files.front(), false);
  return {WholeGrid(series, first), TypeOf(series.files.front(), first), series.files.front().modality};
}

}  // namespace kvx
