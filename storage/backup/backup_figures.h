// What a copy of a data folder is asked for, and what came of it.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

namespace kvx {

struct BackupFigures {
  int64_t files = 0, bytes = 0;  // copied now; what the copy had already is not counted
  // Ids of scans and label maps whose uploads, and of models whose files, are not in the copy, or damaged
  // there: neither side has them whole.
  std::vector<std::string> lost;
};

enum class CopiedBefore {
  kTrusted,  // what lies in the backup with the right size is not read again
  kChecked,  // all of it is read, and copied anew where it is damaged
};

}  // namespace kvx
