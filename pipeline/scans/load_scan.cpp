// Files are hashed a chunk at a time; folders by what of them is read.
#include "pipeline/scans/load_scan.h"

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <set>

#include "core/errors.h"
#include "core/numbers/value_range.h"
#include "pipeline/io/dicom/series_folder.h"
#include "pipeline/io/mask_folder.h"
#include "pipeline/io/volume_file.h"
#include "pipeline/scans/filled_corners.h"
#include "pipeline/scans/grey_kind.h"
#include "pipeline/scans/slice_alternation.h"

namespace kvx {
namespace {

Digest FileDigest(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in && IsDenial(errno))
    throw Denied("a scan file may not be read; ask its owner for the right to read it");
  if (!in) throw InputError("a scan file cannot be opened; check that it exists and may be read");
  const Digest digest = Sha256(in);
  if (in.bad()) throw InputError("a scan file cannot be read to the end; check the disk it lies on");
  return digest;
}

// Of the files' names below the folder and their bytes, in the order of the names.
Digest FolderDigest(const std::filesystem::path& folder, const std::vector<std::filesystem::path>& files) {
  std::set<std::string> names;
  for (const std::filesystem::path& file : files)
    names.insert(file.lexically_relative(folder).generic_string());
  Hasher hasher;
  for (const std::string& name : names) hasher.Add(name).Add(FileDigest(folder / name));
  return hasher.Finish();
}

// Sums of squares of greys stay far below what floats hold. What is written with another type or byte order
// than the header says, or lacks a byte, has greys of all sizes; a few strays do no harm.
void RequireGreys(const Volume& scan) {
  constexpr float kMost = 1e12f;
  const ValueRange usual = UsualRangeOf(scan.values);
  if (usual.least >= -kMost && usual.most <= kMost) return;
  throw InputError(
      "the voxels of a scan hold numbers beyond 1e12, which no scanner measures; its file is damaged, or of "
      "another voxel type or byte order than it says: export it again");
}

}  // namespace

Digest ContentDigest(const std::filesystem::path& file_or_folder) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file_or_folder, ignored))
    return FolderDigest(file_or_folder, SeriesFiles(file_or_folder));
  const std::filesystem::path data = DetachedData(file_or_folder);
  if (data.empty()) return FileDigest(file_or_folder);
  return Hasher().Add(FileDigest(file_or_folder)).Add(FileDigest(data)).Finish();
}

Scan ReadScanEvenly(const std::filesystem::path& path) {
  Scan scan = ReadScan(path);
  scan.denied_ct = scan.modality == "CT" && ContradictsCt(scan.volume);
  if (scan.denied_ct) scan.modality.clear();
  scan.volume = WithoutImpossibleFilling(std::move(scan.volume), scan.modality);
  RequireGreys(scan.volume);
  scan.evened_slices = EvenSlices(scan);
  return scan;
}

Digest LabelsDigest(const std::filesystem::path& labels, const std::vector<StudyBone>& bones) {
  if (!HoldsMasks(labels, bones)) return ContentDigest(labels);
  std::vector<std::filesystem::path> files;
  for (const StudyBone& bone : bones) {
    const std::filesystem::path mask = MaskOf(labels, bone.name);
    for (const std::filesystem::path& file : {mask, DetachedData(mask)}) {
      if (!file.empty()) files.push_back(file);
    }
  }
  return FolderDigest(labels, files);
}

Scan LoadScan::Run(const Inputs& inputs, const Options&, StageContext&) {
  Scan scan = ReadScanEvenly(inputs.path);
  const auto [least, most] = std::ranges::minmax(scan.volume.values);
  if (least == most)
    throw InputError("a scan has the same value everywhere and shows nothing; export it again");
  return scan;
}

}  // namespace kvx
