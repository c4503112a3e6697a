// A phantom of any size, for tests and for WritePhantom.
#pragma once
#include "pipeline/phantom/acquisition.h"
#include "pipeline/phantom/phantom.h"

namespace kvx::phantom {

struct PhantomSettings {
  Region region = Region::kKnee;
  uint64_t seed = 1;
  ScanGrid grid;
  double cell_mm = 0;  // of the elastic solid; 0: the anatomy's own
  double snr = 16;     // mean of the body over the noise's sigma
  int points = 20000;
  std::vector<std::string> poses;  // names, the template's is always there; empty: all
  int threads = 0;                 // 0: all cores; the result does not depend on it
};

PhantomSettings SettingsFor(const PhantomOptions& options);
// Throws InputError when `folder` is a file or is not empty, Unavailable when it cannot be written.
void WritePhantom(const PhantomSettings& settings, const std::filesystem::path& folder,
                  const Progress& progress);

}  // namespace kvx::phantom
