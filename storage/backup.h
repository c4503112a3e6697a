// A copy of a data folder made while the service runs, and the way back. The copy is a data folder itself.
#pragma once
#include <cstdint>
#include <filesystem>

#include "core/host/progress.h"

namespace kvx {

struct BackupFigures {
  int64_t files = 0, bytes = 0;  // copied now; what the copy had already is not counted
};

enum class CopiedBefore {
  kTrusted,  // what lies in the backup with the right size is not read again
  kChecked,  // all of it is read, and copied anew where it is damaged
};

// Both: InputError where one folder lies within the other. Progress is told, and asked for a wish to stop,
// between two files; a backup that stops leaves the one before it whole.

// The database as of one moment, and every blob, model and artefact that its records need. Into an older
// backup only what is new is copied, and what was removed since goes there too. Throws InputError for a
// folder that holds other things, or is a data folder, and leaves it as it is.
BackupFigures BackUp(const std::filesystem::path& data, const std::filesystem::path& backup,
                     CopiedBefore before = CopiedBefore::kTrusted, const Progress& progress = {});

// Checks the backup's database and every upload that it names, a series' files all of them,
// then copies into a folder that is empty or not there (InputError otherwise). Throws Unavailable where the
// backup loses what its records named, as a data folder in use may.
BackupFigures Restore(const std::filesystem::path& backup, const std::filesystem::path& data,
                      const Progress& progress = {});

}  // namespace kvx
