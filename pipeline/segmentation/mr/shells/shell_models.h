// What shells show for every thickness and every radius of a bone, with the one blur of a scan.
#pragma once
#include "pipeline/segmentation/mr/shells/shell_profile.h"

namespace kvx {

class ShellModels {
 public:
  static constexpr int kThicknesses = 16;                            // up to one whose marrow is out of sight
  static double ThicknessOf(double number) { return 0.2 * number; }  // voxels
  // Of the nearest radius that there is a model for.
  static int NumberOfRadius(double radius_voxels);

  explicit ShellModels(double blur);  // in voxels, as all lengths
  ShellProfile::Misfits MisfitsOf(const ShellProfile::Samples& samples, int radius, int thickness) const;

 private:
  std::vector<ShellProfile> models_;  // thickness by thickness
};

}  // namespace kvx
