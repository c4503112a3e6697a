// The mark stands after a preamble of 128 bytes (PS3.10, 7.1).
#include "core/series_file.h"

#include <algorithm>
#include <array>
#include <string>

#include "core/errors.h"
#include "core/lower_case.h"

namespace kvx {
namespace {

constexpr size_t kPreamble = 128;
constexpr std::string_view kMark = "DICM";
constexpr std::array<std::string_view, 4> kEndingsOfImages{".dcm", ".ima", ".dicom", ".img"};

std::string_view EndingOf(std::string_view name) {
  const size_t dot = name.rfind('.');
  return dot == name.npos ? std::string_view() : name.substr(dot);
}

bool IsText(std::string_view head) {
  return !head.empty() && std::ranges::all_of(head, [](char c) {
    return uint8_t(c) >= 0x20 || c == '\t' || c == '\r' || c == '\n';
  });
}

bool IsFolderAside(const std::filesystem::path& name) {
  const std::string text = name.string();
  return (text.starts_with(".") && text != ".") || text.starts_with("__MACOSX");
}

// Of a link to nowhere only the name tells what it should lead to.
void RequireThere(const std::filesystem::directory_entry& file) {
  if (file.exists() || SeriesFileOf(file.path().filename().string(), {}) != SeriesFile::kBroken) return;
  throw InputError(
      "the folder of DICOM images holds links to images that are not there; fetch the images (git-annex: "
      "git annex get), or remove the links");
}

}  // namespace

SeriesFile SeriesFileOf(std::string_view name, std::string_view head) {
  if (head.size() >= kPreamble && head.substr(kPreamble).starts_with(kMark)) return SeriesFile::kImage;
  const std::string ending = LowerCase(std::string(EndingOf(name)));
  if (std::ranges::find(kEndingsOfImages, ending) != kEndingsOfImages.end()) return SeriesFile::kBroken;
  const bool number = ending.find_first_not_of(".0123456789") == ending.npos;  // none, or the end of a UID
  return number && !IsText(head) ? SeriesFile::kBroken : SeriesFile::kAside;
}

bool IsNamedAside(const std::filesystem::path& below) {
  return std::ranges::any_of(below, IsFolderAside) || below.filename().string().starts_with("DICOMDIR");
}

std::vector<std::filesystem::path> SeriesFiles(const std::filesystem::path& folder) {
  std::vector<std::filesystem::path> files;
  try {
    auto entry = std::filesystem::recursive_directory_iterator(folder);
    for (; entry != std::filesystem::recursive_directory_iterator(); ++entry) {
      const std::filesystem::path name = entry->path().filename();
      if (entry->is_directory()) {
        if (IsFolderAside(name)) entry.disable_recursion_pending();
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

}  // namespace kvx
