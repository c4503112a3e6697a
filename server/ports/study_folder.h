// Stored files under the names that a reader goes by: a folder of links, removed at the end.
#pragma once
#include <filesystem>
#include <vector>

#include "api/builder_port.h"
#include "storage/files/data_folder.h"

namespace kvx {

// Reads all bytes of all files. Throws InputError naming the scan of one that is no longer what was uploaded.
void RequireIntact(const std::vector<StudyFile>& files);

class StudyFolder {
 public:
  StudyFolder(const DataFolder& data, const std::vector<StudyFile>& files);
  ~StudyFolder();
  StudyFolder(const StudyFolder&) = delete;
  StudyFolder& operator=(const StudyFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

}  // namespace kvx
