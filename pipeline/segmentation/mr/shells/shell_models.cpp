// Bones thicker than a few blurs look flat.
#include "pipeline/segmentation/mr/shells/shell_models.h"

namespace kvx {
namespace {

constexpr std::array<double, 7> kRadii{1, 1.5, 2, 2.5, 3, 4, INFINITY};
constexpr double kFlat = 5;  // the least radius that counts as infinite

}  // namespace

int ShellModels::NumberOfRadius(double radius_voxels) {
  constexpr int kLast = int(kRadii.size()) - 1;
  if (radius_voxels >= kFlat) return kLast;
  int number = 0;
  while (number + 1 < kLast && radius_voxels > 0.5 * (kRadii[number] + kRadii[number + 1])) ++number;
  return number;
}

ShellModels::ShellModels(double blur) {
  for (int thickness = 0; thickness < kThicknesses; ++thickness) {
    for (const double radius : kRadii) models_.emplace_back(blur, ThicknessOf(thickness), radius);
  }
}

ShellProfile::Misfits ShellModels::MisfitsOf(const ShellProfile::Samples& samples, int radius,
                                             int thickness) const {
  return models_[size_t(thickness) * kRadii.size() + size_t(radius)].MisfitsOf(samples);
}

}  // namespace kvx
