#include "pipeline/io/dicom/dicom_slices.h"

#include <algorithm>
#include <set>

#include "core/errors.h"
#include "pipeline/io/dicom/dicom_axes.h"

namespace kvx {
namespace {

constexpr double kMostPlanes = 100'000;
constexpr double kSlackMm = 1e-6;      // of sums of decimal numbers
constexpr double kSamePlaceMm = 0.01;  // slices are farther apart than this
constexpr double kMostAstray = 0.25;   // of a voxel, of any slice from its place in the grid
const char kSingle[] = "the DICOM series holds a single slice; give a series of a whole volume";
const char kUneven[] =
    "the slices of the DICOM series are unevenly spaced; resample them to one spacing and save as NIfTI";

// Where each of several places along the normal, in order, lies among evenly spaced planes.
struct EvenPlanes {
  std::vector<size_t> plane_of;
  double step_mm = 0;
};

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

std::vector<double> StepsBetween(const std::vector<double>& places_mm) {
  std::vector<double> steps;
  for (size_t p = 1; p < places_mm.size(); ++p) steps.push_back(places_mm[p] - places_mm[p - 1]);
  return steps;
}

// Every step between neighbours must be the same.
EvenPlanes RegularPlanes(const std::vector<double>& places_mm) {
  const std::vector<double> steps = StepsBetween(places_mm);
  const auto [least, most] = std::ranges::minmax(steps);
  if (least < kSamePlaceMm) {
    throw InputError(
        "several slices of the DICOM series lie at the same place (time frames or a second volume); put the "
        "images of one volume in a folder of their own");
  }
  EvenPlanes planes{{}, (places_mm.back() - places_mm.front()) / double(steps.size())};
  for (size_t p = 0; p < places_mm.size(); ++p) planes.plane_of.push_back(p);
  const double tolerance_mm = StepTolerance(planes.step_mm) + kSlackMm;
  if (most - planes.step_mm <= tolerance_mm && planes.step_mm - least <= tolerance_mm) return planes;
  if (most <= 1.5 * least) throw InputError(kUneven);
  throw InputError(
      "a slice of the DICOM series is missing or the gaps between slices differ; export the whole series "
      "again");
}

// A step is one plane or more. `said_mm`: by the file's word, 0 where it says nothing.
EvenPlanes SparsePlanes(const std::vector<double>& places_mm, double said_mm) {
  const std::vector<double> steps = StepsBetween(places_mm);
  const double least = std::ranges::min(steps), of_least = said_mm > 0 ? std::round(least / said_mm) : 0;
  const bool as_said = of_least >= 1 && std::abs(least - of_least * said_mm) <= StepTolerance(said_mm);
  const double about_mm = as_said ? said_mm : least;
  EvenPlanes planes{{0}, 0};
  for (const double step : steps) {
    const double plane = double(planes.plane_of.back()) + std::round(step / about_mm);
    if (!(plane <= kMostPlanes)) throw InputError(kUneven);
    planes.plane_of.push_back(size_t(plane));
  }
  planes.step_mm = (places_mm.back() - places_mm.front()) / double(planes.plane_of.back());
  for (size_t s = 0; s < steps.size(); ++s) {
    const double count = double(planes.plane_of[s + 1] - planes.plane_of[s]);
    if (std::abs(steps[s] - count * planes.step_mm) > StepTolerance(planes.step_mm) + kSlackMm)
      throw InputError(kUneven);
  }
  return planes;
}

// A step's rounding is no harm, but steps add up: every slice must lie where the grid has it.
void RequireStraight(const std::vector<DicomSlice>& slices, const Eigen::Vector3d& normal, double step_mm) {
  const double in_plane_mm = kMostAstray * slices.front().place.spacing_mm.minCoeff();
  for (const DicomSlice& slice : slices) {
    const Eigen::Vector3d from_first = slice.place.position_mm - slices.front().place.position_mm;
    const double along_mm = from_first.dot(normal);
    if ((from_first - normal * along_mm).norm() > in_plane_mm) {
      throw InputError(
          "the slices of the DICOM series are shifted against each other, by more than a quarter of a voxel "
          "in all (gantry tilt); straighten them (dcm2niix does, and writes NIfTI) or export the series "
          "reformatted at right angles");
    }
    if (std::abs(along_mm - double(slice.plane) * step_mm) > kMostAstray * step_mm) throw InputError(kUneven);
  }
}

void SortAlong(const Eigen::Vector3d& normal, std::vector<DicomSlice>& slices) {
  for (DicomSlice& slice : slices) slice.along_normal_mm = normal.dot(slice.place.position_mm);
  std::ranges::stable_sort(slices, {}, &DicomSlice::along_normal_mm);
}

std::vector<DicomSlice> ParallelSlices(const std::vector<DicomFile>& files) {
  const DicomFrame& first = files.front().frames.front();
  std::vector<DicomSlice> slices;
  for (size_t file = 0; file < files.size(); ++file) {
    for (size_t frame = 0; frame < files[file].frames.size(); ++frame) {
      RequireSamePlane(first, files[file].frames[frame]);
      slices.push_back({file, frame, files[file].frames[frame]});
    }
  }
  if (!(first.spacing_mm.minCoeff() > 0)) {
    throw InputError(
        "the DICOM series gives a pixel spacing that is not a positive number; export it again or convert it "
        "to NIfTI");
  }
  if (slices.size() < 2) throw InputError(kSingle);
  return slices;
}

// With the axes of the grid, and its origin and spacing in the plane.
DicomSlices InOrder(const std::vector<DicomFile>& files) {
  DicomSlices placed{ParallelSlices(files), {}};
  std::vector<DicomSlice>& slices = placed.slices;
  const DicomFrame& first = files.front().frames.front();
  SortAlong(first.along_row.cross(first.along_column).normalized(), slices);
  placed.grid.direction = AxesOf(first, slices.back().place.position_mm - slices.front().place.position_mm);
  SortAlong(placed.grid.direction.col(2), slices);
  placed.grid.spacing_mm << first.spacing_mm, 0;
  placed.grid.origin.lps = slices.front().place.position_mm;
  return placed;
}

// Of each plane once, and of each slice which of them.
struct Places {
  std::vector<double> mm;
  std::vector<size_t> of;
};

Places PlacesOf(const std::vector<DicomSlice>& slices, bool shared) {
  Places places;
  for (const DicomSlice& slice : slices) {
    if (!shared || places.mm.empty() || slice.along_normal_mm - places.mm.back() >= kSamePlaceMm)
      places.mm.push_back(slice.along_normal_mm);
    places.of.push_back(places.mm.size() - 1);
  }
  if (places.mm.size() < 2) throw InputError(kSingle);
  return places;
}

void PutOn(const EvenPlanes& planes, const Places& places, DicomSlices& placed) {
  for (size_t s = 0; s < placed.slices.size(); ++s) placed.slices[s].plane = planes.plane_of[places.of[s]];
  RequireStraight(placed.slices, placed.grid.direction.col(2), planes.step_mm);
  placed.grid.spacing_mm.z() = planes.step_mm;
}

void RequireSegmentsOnce(const std::vector<DicomSlice>& slices) {
  std::set<std::pair<int, size_t>> seen;
  for (const DicomSlice& slice : slices) {
    if (seen.emplace(slice.place.segment, slice.plane).second) continue;
    throw InputError(
        "the DICOM segmentation (SEG) holds a segment twice at the same place (two segmentations?); put the "
        "file of the one you mean in a folder of its own");
  }
}

}  // namespace

Grid DicomSlices::GridOf(int columns, int rows) const {
  Grid whole = grid;
  whole.size = {columns, rows, int(slices.back().plane) + 1};
  return whole;
}

bool Turned(const DicomFrame& a, const DicomFrame& b) {
  return std::max((a.along_row - b.along_row).norm(), (a.along_column - b.along_column).norm()) > 1e-3;
}

DicomSlices PlaceScan(const std::vector<DicomFile>& files) {
  DicomSlices placed = InOrder(files);
  const Places places = PlacesOf(placed.slices, false);
  PutOn(RegularPlanes(places.mm), places, placed);
  return placed;
}

DicomSlices PlaceSegments(const std::vector<DicomFile>& files) {
  DicomSlices placed = InOrder(files);
  const Places places = PlacesOf(placed.slices, true);
  PutOn(SparsePlanes(places.mm, files.front().between_mm), places, placed);
  RequireSegmentsOnce(placed.slices);
  return placed;
}

}  // namespace kvx
