// The data folder of a service, for commands that work beside a running one: SQLite lets several processes
// in.
#pragma once
#include <filesystem>

namespace kvx {

// Throws NotFound for a folder that holds other things: a mistyped one is not to be filled. One that is
// missing or empty may become a data folder; what a file system itself puts there does not count.
void RequireDataFolderOrEmpty(const std::filesystem::path& data);
// Throws NotFound for anything but a data folder.
void RequireDataFolder(const std::filesystem::path& data);

// The database of a data folder. Throws NotFound when there is none.
std::filesystem::path DatabaseOf(const std::filesystem::path& data);
// The same of a folder that is missing or empty, which becomes a data folder; stderr says so.
std::filesystem::path DatabaseOfMaybeNew(const std::filesystem::path& data);

}  // namespace kvx
