// What a file is to the DICOM series in whose folder or archive it lies: one rule for all doors.
#pragma once
#include <cstddef>
#include <filesystem>
#include <string_view>

namespace kvx {

enum class SeriesFile {
  kImage,   // begins as DICOM files do
  kAside,   // what media, exports and people put beside the images
  kBroken,  // called like an image, but does not begin like one: cut off, or of an old program
};

constexpr size_t kSeriesFileHead = 4096;  // bytes that tell

// By the name and the first kSeriesFileHead bytes, all of them where there are fewer. Neither tells of names
// that go aside whatever they hold.
SeriesFile SeriesFileOf(std::string_view name, std::string_view head);

// Hidden files and folders, with what is in them, and what systems and media add: __MACOSX, files DICOMDIR.
// `below`: from the folder of the series on.
bool IsNamedAside(const std::filesystem::path& below);
bool IsFolderNamedAside(const std::filesystem::path& name);  // of a folder itself

}  // namespace kvx
