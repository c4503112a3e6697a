// Blobs have no endings; the links do.
#include "server/ports/study_folder.h"

#include "core/errors.h"
#include "storage/files/blob_store.h"
#include "storage/ids.h"

namespace kvx {

void RequireIntact(const std::vector<StudyFile>& files) {
  for (const StudyFile& file : files) {
    if (!IsIntact(file.content))
      throw InputError("the uploaded file " + std::filesystem::path(file.name).filename().string() +
                       " is damaged on the service's disk; upload it again, then ask for the job anew");
  }
}

StudyFolder::StudyFolder(const DataFolder& data, const std::vector<StudyFile>& files)
    : path_(data.work() / NewId("std")) {
  for (const StudyFile& file : files) {
    const std::filesystem::path link = path_ / file.name;
    std::filesystem::create_directories(link.parent_path());
    std::filesystem::create_symlink(file.content, link);
  }
}

StudyFolder::~StudyFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

}  // namespace kvx
