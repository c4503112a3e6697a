// What of a volume's file is known without reading its voxels.
#pragma once
#include <string>

#include "core/scan.h"

namespace kvx {

struct VolumeInfo {
  Grid grid;
  ScalarType stored_as = ScalarType::kFloat32;
  std::string modality;
};

}  // namespace kvx
