// A copy of a data folder made while the service runs, and the way back. The copy is a data folder itself.
#pragma once
#include <filesystem>

#include "core/host/progress.h"
#include "storage/backup/backup_figures.h"

namespace kvx {

enum class Lost { kRefused, kLeftOut };

// Both: InputError where one folder lies within the other. Progress is told, and asked for a wish to stop,
// between two files; a backup that stops leaves the one before it whole.

// The database as of one moment, and every upload, model and artefact that its records need and the data
// folder has. Into an older backup only what is new is copied, and what was removed since goes there too;
// what the data folder has lost stays. Throws InputError for a folder that holds other things, or is a data
// folder, and leaves it as it is.
BackupFigures BackUp(const std::filesystem::path& data, const std::filesystem::path& backup,
                     CopiedBefore before = CopiedBefore::kTrusted, const Progress& progress = {});

// Checks the backup's database, that every model is there, and every upload, a series' files all of them,
// then copies into a folder that is empty or not there (InputError otherwise, and for what was lost or
// damaged where that is refused). Throws Unavailable where the backup loses what its records named, as a data
// folder in use may.
BackupFigures Restore(const std::filesystem::path& backup, const std::filesystem::path& data,
                      Lost lost = Lost::kRefused, const Progress& progress = {});

}  // namespace kvx
