// Files are hashed a chunk at a time; a folder by its sorted relative names and contents.
#include "pipeline/scans/load_scan.h"

#include <algorithm>
#include <fstream>

#include "core/errors.h"
#include "pipeline/io/volume_file.h"
#include "pipeline/scans/slice_alternation.h"

namespace kvx {
namespace {

Digest FileDigest(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  if (!in) throw InputError("a scan file cannot be opened; check that it exists and may be read");
  const Digest digest = Sha256(in);
  if (in.bad()) throw InputError("a scan file cannot be read to the end; check the disk it lies on");
  return digest;
}

std::vector<std::string> RelativeNames(const std::filesystem::path& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.is_regular_file()) names.push_back(entry.path().lexically_relative(folder).generic_string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

Digest FolderDigest(const std::filesystem::path& folder) {
  Hasher hasher;
  for (const std::string& name : RelativeNames(folder)) hasher.Add(name).Add(FileDigest(folder / name));
  return hasher.Finish();
}

}  // namespace

Digest ContentDigest(const std::filesystem::path& file_or_folder) {
  try {
    if (std::filesystem::is_directory(file_or_folder)) return FolderDigest(file_or_folder);
  } catch (const std::filesystem::filesystem_error&) {  // its text holds the path
    throw InputError("a folder of the study cannot be read; check that it may be opened");
  }
  const std::filesystem::path data = DetachedData(file_or_folder);
  if (data.empty()) return FileDigest(file_or_folder);
  return Hasher().Add(FileDigest(file_or_folder)).Add(FileDigest(data)).Finish();
}

Scan ReadScanEvenly(const std::filesystem::path& path) {
  Scan scan = ReadScan(path);
  scan.evened_slices = EvenSlices(scan);
  return scan;
}

Scan LoadScan::Run(const Inputs& inputs, const Options&, StageContext&) {
  Scan scan = ReadScanEvenly(inputs.path);
  const auto [least, most] = std::ranges::minmax(scan.volume.values);
  if (least == most)
    throw InputError("a scan has the same value everywhere and shows nothing; export it again");
  return scan;
}

}  // namespace kvx
