// Small files that are complete or absent: temporary name, fsync, rename.
#pragma once
#include <filesystem>
#include <functional>
#include <string_view>

namespace kvx {

// Replaces `path`. Throws Unavailable when it cannot be written; what was there before then stays.
void ReplaceFile(const std::filesystem::path& path, std::string_view bytes);

// For writers that want a path of their own: `write` makes the file at the path it is given, which has the
// same extension and lies in the same folder; then it is synced and renamed to `path`.
void ReplaceFileBy(const std::filesystem::path& path,
                     const std::function<void(const std::filesystem::path& temporary)>& write);

}  // namespace kvx
