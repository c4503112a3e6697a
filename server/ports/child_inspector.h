// Uploads are read in a child process: a file that makes its reader crash, hang or take all memory costs its
// sender a 400, not everybody the service.
#pragma once
#include <filesystem>

#include "api/inspector_port.h"
#include "server/turns/project_turns.h"

namespace kvx {

struct InspectionLimits {
  int seconds = 120;                         // of processor time, and of wall time unless the machine is busy
  int64_t memory_bytes = int64_t(12) << 30;  // of address space
  int at_the_same_time = 2;                  // of one project one; more wait. Archives are counted apart
  int waiting_of_project = 16;               // beyond: Unavailable
};

class ChildInspector final : public ScanInspector {
 public:
  // `program inspect-upload KIND FILE [REGION]` must be this program.
  // Once it has `drained`, what is under way ends as Unavailable.
  explicit ChildInspector(
      std::filesystem::path program, InspectionLimits limits = {},
      std::function<bool()> drained = [] { return false; })
      : program_(std::move(program)),
        limits_(limits),
        drained_(std::move(drained)),
        turns_(limits.at_the_same_time, limits.waiting_of_project),
        archive_turns_(limits.at_the_same_time, limits.waiting_of_project) {}
  ScanFacts InspectScan(const std::filesystem::path& file_or_folder, const std::string& project) override;
  LabelFacts InspectLabels(const std::filesystem::path& file, const std::string& region,
                           const std::string& project) override;
  ScanFacts InspectSeries(const std::filesystem::path& archive, const std::filesystem::path& folder,
                          const std::string& project, const std::function<void(size_t)>& unpacked) override;

 private:
  void RequireNotDrained() const;
  std::string Ask(const std::vector<std::string>& words,  // of the program's command line
                  const std::string& project);
  std::filesystem::path program_;
  InspectionLimits limits_;
  std::function<bool()> drained_;
  ProjectTurns turns_;
  ProjectTurns archive_turns_;  // from the first byte unpacked: what is unpacked and not looked at is bounded
};

// The child's side: takes the limits upon itself, inspects, and says what it found as JSON:
// {"facts"} or {"refusal"}.
std::string InspectInThisProcess(const std::string& kind, const std::filesystem::path& path,
                                 const std::string& region, const InspectionLimits& limits);

}  // namespace kvx
