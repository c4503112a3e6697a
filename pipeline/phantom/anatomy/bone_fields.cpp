// Filling and reading the distance grids.
#include "pipeline/phantom/anatomy/bone_fields.h"

#include "core/host/parallel.h"
#include "pipeline/phantom/trilinear.h"

namespace kvx::phantom {

DistanceGrid SampleDistance(const Box& box, double step_mm,
                            const std::function<double(const Eigen::Vector3d&)>& distance) {
  DistanceGrid grid;
  grid.step_mm = step_mm;
  grid.box = box;
  grid.size = ((box.high - box.low) / step_mm).array().ceil().cast<int>() + 2;
  grid.values.resize(size_t(grid.size.x()) * grid.size.y() * grid.size.z());
  ParallelFor(size_t(grid.size.z()), [&](int k) {
    size_t index = size_t(k) * grid.size.x() * grid.size.y();
    for (int j = 0; j < grid.size.y(); ++j) {
      for (int i = 0; i < grid.size.x(); ++i, ++index) {
        grid.values[index] = float(distance(box.low + step_mm * Eigen::Vector3d(i, j, k)));
      }
    }
  });
  return grid;
}

double DistanceGrid::At(const Eigen::Vector3d& x) const {
  return TrilinearAt(values, size, (x - box.low) / step_mm).value_or(kFarMm);
}

BoneFields::BoneFields(const Anatomy& anatomy) {
  for (size_t b = 0; b < anatomy.bones.size(); ++b) {
    const auto distance = [&](const Eigen::Vector3d& x) { return anatomy.RigidDistance(int(b), x); };
    grids_.push_back(SampleDistance(anatomy.bones[b].shape.Bounds().Grown(kBoneMarginMm),
                                    anatomy.distance_step_mm, distance));
  }
}

NearestBone BoneFields::Nearest(const Eigen::Vector3d& x) const {
  NearestBone nearest;
  for (int b = 0; b < size(); ++b) {
    const double d = Distance(b, x);
    if (d < nearest.distance_mm) nearest = {b, d};
  }
  return nearest;
}

}  // namespace kvx::phantom
