// Uploads are read in a child process: a file that makes its reader crash, hang or take all memory costs its
// sender a 400, not everybody the service.
#pragma once
#include <condition_variable>
#include <filesystem>
#include <mutex>

#include "api/inspector_port.h"

namespace kvx {

struct InspectionLimits {
  int seconds = 120;                         // of wall time and of processor time
  int64_t memory_bytes = int64_t(12) << 30;  // of address space
  int at_the_same_time = 2;                  // more wait
};

class ChildInspector final : public ScanInspector {
 public:
  // `program inspect-upload KIND FILE [REGION]` must be this program.
  explicit ChildInspector(std::filesystem::path program, InspectionLimits limits = {})
      : program_(std::move(program)), limits_(limits) {}
  ScanFacts InspectScan(const std::filesystem::path& file_or_folder) override;
  LabelFacts InspectLabels(const std::filesystem::path& file, const std::string& region) override;

 private:
  std::string Ask(const std::vector<std::string>& words);  // of the program's command line
  std::filesystem::path program_;
  InspectionLimits limits_;
  std::mutex mutex_;
  std::condition_variable ended_;
  int running_ = 0;
};

// The child's side: takes the limits upon itself, inspects, and says what it found as JSON:
// {"facts"} or {"refusal"}.
std::string InspectInThisProcess(const std::string& kind, const std::filesystem::path& path,
                                 const std::string& region, const InspectionLimits& limits);

}  // namespace kvx
