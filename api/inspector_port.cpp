// What every inspector does with an archive: the folder it was unpacked into is a scan.
#include "api/inspector_port.h"

#include "storage/files/archive.h"

namespace kvx {

ScanFacts ScanInspector::InspectSeries(const std::filesystem::path& archive,
                                       const std::filesystem::path& folder, const std::string& project,
                                       const std::function<void(size_t)>& unpacked) {
  UnpackSeries(archive, folder, {}, unpacked);
  return InspectScan(folder, project);
}

}  // namespace kvx
