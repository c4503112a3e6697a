// What was written survives a loss of power.
#pragma once
#include <filesystem>

namespace kvx {

// Flushes a file's bytes, or a folder's names, to disk (fsync). False when that cannot be done.
[[nodiscard]] bool FlushToDisk(const std::filesystem::path& file_or_folder);

}  // namespace kvx
