// Synthetic studies with exact truth: soft tissue moved by an elastic solid with rigid bones, never by
// skinning.
#pragma once
#include <filesystem>

#include "core/progress.h"
#include "core/study.h"

namespace kvx {

struct PhantomOptions {
  Region region = Region::kKnee;  // kHand or kKnee
  uint64_t seed = 1;              // anatomy, poses, texture, noise, bias
  bool half_scale = false;        // half the paper's resolution along every axis
};

// Writes scans, bones_template.nii.gz, study.json, manifest.json and truth/poseNN_points.npz into `folder`
// (see docs/phantom.md).
void WritePhantom(const PhantomOptions& options, const std::filesystem::path& folder,
                  const Progress& progress);

}  // namespace kvx
