#include "pipeline/io/dicom/dicom_files.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <iterator>
#include <map>
#include <set>

#include "core/digest.h"
#include "core/errors.h"
#include "core/text/listed.h"
#include "pipeline/io/dicom/dicom_slices.h"
#include "pipeline/io/dicom/series_folder.h"

namespace kvx {
namespace {

std::string Count(size_t n, const std::string& what) { return std::to_string(n) + " " + what; }

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

std::vector<DicomFile> OfBodies(std::vector<DicomFile> files) {
  if (files.empty())
    throw InputError("the folder holds no DICOM images; give a folder with one DICOM series");
  const bool segments = Holds(files, DicomContent::kSegments);
  std::erase_if(files, [](const DicomFile& file) { return file.content != DicomContent::kBody; });
  if (!files.empty()) return files;
  if (segments) {
    throw InputError(
        "the DICOM images are a segmentation (SEG) and no scan; give the MR or CT series that it was drawn "
        "on, and the segmentation as the label map of its bones");
  }
  throw InputError(
      "the DICOM images are doses, parametric maps, images of a treatment or the like and no scan; give the "
      "series of an MR or CT volume");
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

void RequirePlaces(const std::vector<DicomFile>& series) {
  for (const DicomFile& file : series) {
    if (!file.miscounted) continue;
    throw InputError("a DICOM image says that it holds " + Count(file.miscounted->first, "frames") +
                     " (Number of Frames), but where " + Count(file.miscounted->second, "of them") +
                     " lie (Per-frame Functional Groups); export the images again");
  }
  if (std::ranges::none_of(series, [](const DicomFile& file) { return file.frames.empty(); })) return;
  throw InputError(
      "the DICOM images do not say where they lie in the patient (position, orientation or pixel spacing "
      "is missing); give a series of slices of an MR or CT volume");
}

void RequireSegments(const std::vector<DicomFile>& segmentation) {
  for (const DicomFile& file : segmentation) {
    if (file.numbered || std::ranges::all_of(file.frames, &DicomFrame::segment)) continue;
    throw InputError(
        "the DICOM segmentation (SEG) does not say which of its segments a frame is of; save it again, or as "
        "a label map (.nii.gz, .nrrd)");
  }
}

void RequireOneVolume(const std::vector<DicomFile>& series) {
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

}  // namespace

std::vector<DicomFile> ReadDicomHeaders(const std::filesystem::path& path) {
  std::vector<DicomFile> files;
  const bool folder = std::filesystem::is_directory(path);
  for (const std::filesystem::path& file :
       folder ? SeriesFiles(path) : std::vector<std::filesystem::path>{path}) {
    if (auto header = ReadDicomHeader(file)) files.push_back(*std::move(header));
  }
  return files;
}

std::vector<DicomFile> ScanFiles(std::vector<DicomFile> all) {
  std::vector<DicomFile> series = WithoutCopies(TheSeries(OfBodies(std::move(all))));
  RequirePlaces(series);
  RequireOneVolume(series);
  return series;
}

std::vector<DicomFile> SegmentationFiles(const std::vector<DicomFile>& all) {
  std::vector<DicomFile> files;
  std::ranges::copy_if(all, std::back_inserter(files),
                       [](const DicomFile& file) { return file.content == DicomContent::kSegments; });
  std::set<std::string> series;
  for (const DicomFile& file : files) series.insert(file.series);
  if (series.size() > 1) {
    throw InputError(
        "the folder holds " +
        Count(series.size(), "DICOM segmentations (SEG); put the one you mean in a folder of its own"));
  }
  files = WithoutCopies(std::move(files));
  RequirePlaces(files);
  RequireSegments(files);
  return files;
}

}  // namespace kvx
