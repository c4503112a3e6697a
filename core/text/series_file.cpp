// The mark stands after a preamble of 128 bytes (PS3.10, 7.1).
#include "core/text/series_file.h"

#include <algorithm>
#include <array>
#include <string>

#include "core/text/lower_case.h"

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

}  // namespace

SeriesFile SeriesFileOf(std::string_view name, std::string_view head) {
  if (head.size() >= kPreamble && head.substr(kPreamble).starts_with(kMark)) return SeriesFile::kImage;
  const std::string ending = LowerCase(std::string(EndingOf(name)));
  if (std::ranges::find(kEndingsOfImages, ending) != kEndingsOfImages.end()) return SeriesFile::kBroken;
  const bool number = ending.find_first_not_of(".0123456789") == ending.npos;  // none, or the end of a UID
  return number && !IsText(head.substr(0, kSeriesFileHead)) ? SeriesFile::kBroken : SeriesFile::kAside;
}

bool IsNamedAside(const std::filesystem::path& below) {
  return std::ranges::any_of(below, IsFolderNamedAside) || below.filename().string().starts_with("DICOMDIR");
}

bool IsFolderNamedAside(const std::filesystem::path& name) {
  const std::string text = name.string();
  return (text.starts_with(".") && text != ".") || text.starts_with("__MACOSX");
}

}  // namespace kvx
