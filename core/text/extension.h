// The extension by which a file's name chooses its format, in any case: names differ in case from system to
// system.
#pragma once
#include <filesystem>
#include <string_view>

#include "core/text/lower_case.h"

namespace kvx {

// `extension` in small letters, with all its dots: ".nii.gz".
inline bool HasExtension(const std::filesystem::path& named, std::string_view extension) {
  return LowerCase(named.filename().string()).ends_with(extension);
}

}  // namespace kvx
