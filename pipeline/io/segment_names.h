// What a segmentation itself calls its segments.
#pragma once
#include <filesystem>
#include <map>
#include <string>

namespace kvx {

// By label, as ReadLayeredLabels numbers them; none of a file that tells no names.
std::map<int, std::string> ReadSegmentNames(const std::filesystem::path& labels);

}  // namespace kvx
