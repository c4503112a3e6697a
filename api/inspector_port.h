// The port that reads an upload before it is accepted.
#pragma once
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

#include "core/proposed_bone.h"
#include "core/scan.h"

namespace kvx {

struct ScanFacts {
  Grid grid;
  ScalarType stored_as = ScalarType::kFloat32;
  std::string modality;
};

struct LabelFacts {
  Grid grid;
  std::vector<int> labels;  // values that occur, without 0
  std::vector<ProposedBone> bones;
};

// Reads an upload of a project before it is accepted. Throws InputError saying what to do, Unavailable when
// too many of the project wait for that.
class ScanInspector {
 public:
  virtual ~ScanInspector() = default;
  virtual ScanFacts InspectScan(const std::filesystem::path& file_or_folder, const std::string& project) = 0;
  // `region` as of the subject: what the names are proposed from.
  virtual LabelFacts InspectLabels(const std::filesystem::path& file, const std::string& region,
                                   const std::string& project) = 0;
  // Unpacks a packed series into a folder first. `unpacked` as of UnpackSeries (storage/files/archive.h).
  virtual ScanFacts InspectSeries(const std::filesystem::path& archive, const std::filesystem::path& folder,
                                  const std::string& project, const std::function<void(size_t)>& unpacked);
};

}  // namespace kvx
