// The folder of a DICOM series: which of its files may belong to it, and their first bytes, which tell.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "core/text/series_file.h"

namespace kvx {

// What of a folder and the folders in it may belong to a series, sorted: all files whose names do not go
// aside. Throws InputError for a folder that cannot be read and for links to images that are not there.
std::vector<std::filesystem::path> SeriesFiles(const std::filesystem::path& folder);

// The first bytes of a file, all where it has fewer; none of one that cannot be read.
std::string HeadOf(const std::filesystem::path& file, size_t bytes = kSeriesFileHead);

SeriesFile SeriesFileAt(const std::filesystem::path& file);  // by its name and first bytes

}  // namespace kvx
