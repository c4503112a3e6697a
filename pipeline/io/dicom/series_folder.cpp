// Folders that go aside are not entered: they may be closed to the reader.
#include "pipeline/io/dicom/series_folder.h"

#include <algorithm>
#include <fstream>

#include "core/errors.h"

namespace kvx {
namespace {

// Of a link to nowhere only the name tells what it should lead to.
void RequireThere(const std::filesystem::directory_entry& file) {
  if (file.exists() || SeriesFileOf(file.path().filename().string(), {}) != SeriesFile::kBroken) return;
  throw InputError(
      "the folder of DICOM images holds links to images that are not there; fetch the images (git-annex: "
      "git annex get), or remove the links");
}

}  // namespace

std::vector<std::filesystem::path> SeriesFiles(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  try {
    auto entry = std::filesystem::recursive_directory_iterator(folder);
    for (; entry != std::filesystem::recursive_directory_iterator(); ++entry) {
      const std::filesystem::path name = entry->path().filename();
      if (entry->is_directory()) {
        if (IsFolderNamedAside(name)) entry.disable_recursion_pending();
      } else if (!IsNamedAside(name)) {
        RequireThere(*entry);
        if (entry->is_regular_file()) files.push_back(entry->path());
      }
    }
  } catch (const std::filesystem::filesystem_error&) {  // its text holds the path
    throw InputError("the folder of DICOM images cannot be read; check that it may be opened");
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::string HeadOf(const std::filesystem::path& file, size_t bytes) {
  std::string head(bytes, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(head.data(), std::streamsize(head.size()));
  head.resize(size_t(in.gcount()));
  return head;
}

SeriesFile SeriesFileAt(const std::filesystem::path& file) {
  return SeriesFileOf(file.filename().string(), HeadOf(file));
}

}  // namespace kvx
