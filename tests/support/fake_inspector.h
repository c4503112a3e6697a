// An inspector that looks at six bytes.
#pragma once
#include <atomic>
#include <fstream>
#include <mutex>
#include <set>

#include "api/inspector_port.h"
#include "core/errors.h"
#include "tests/support/meanwhile.h"

namespace kvx::testing_support {

// Accepts files that start with "VOXELS"; a folder is a scan of as many slices as it holds files.
class FakeInspector final : public ScanInspector {
 public:
  PointMm origin;  // of every volume
  std::mutex mutex;
  std::set<std::string> projects;  // whose uploads were inspected
  Meanwhile meanwhile;             // while the next upload is looked at
  ScanFacts InspectScan(const std::filesystem::path& path, const std::string& project) override {
    {
      const std::lock_guard lock(mutex);
      projects.insert(project);
    }
    meanwhile.Happen();
    ScanFacts facts;
    facts.grid.size = {4, 5, 6};
    facts.grid.origin = origin;
    facts.modality = "MR";
    facts.stored_as = ScalarType::kInt16;
    if (std::filesystem::is_directory(path)) {
      facts.grid.size.z() = int(std::distance(std::filesystem::directory_iterator(path), {}));
      return facts;
    }
    std::string start(6, '\0');
    std::ifstream(path, std::ios::binary).read(start.data(), 6);
    if (start != "VOXELS") throw InputError("the file is not a readable volume");
    return facts;
  }
  std::atomic<bool> background_alone{false};  // of what comes as labels
  LabelFacts InspectLabels(const std::filesystem::path& path, const std::string& region,
                           const std::string& project) override {
    LabelFacts facts{InspectScan(path, project).grid, {1, 2}, {}};
    if (background_alone) facts.labels = {255};
    for (const int label : facts.labels) facts.bones.push_back({label, 10, 0.1, {}, region, "", 1, ""});
    return facts;
  }
};

}  // namespace kvx::testing_support
