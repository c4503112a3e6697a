// Synthetic studies with exact truth: soft tissue moved by an elastic solid with rigid bones, never by
// skinning. Of the given sizes, and of any for tests.
#pragma once
#include <filesystem>

#include "core/host/progress.h"
#include "core/study.h"
#include "pipeline/phantom/acquisition.h"

namespace kvx {

struct PhantomOptions {
  Region region = Region::kKnee;  // kHand or kKnee
  uint64_t seed = 1;              // anatomy, poses, texture, noise, bias
  bool half_scale = false;        // half the paper's resolution along every axis
};

// Writes scans, bones_template.nii.gz, study.json, manifest.json and truth/poseNN_points.npz into `folder`
// (see docs/phantom.md). Returns sentences on poses in which much tissue shares its place with other tissue.
std::vector<std::string> WritePhantom(const PhantomOptions& options, const std::filesystem::path& folder,
                                      const Progress& progress);

}  // namespace kvx

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
std::vector<std::string> WritePhantom(const PhantomSettings& settings, const std::filesystem::path& folder,
                                      const Progress& progress);

}  // namespace kvx::phantom
