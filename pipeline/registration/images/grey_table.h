// Another sequence shows tissues in other greys, and edges as mixtures of those: what the scan would show at
// a voxel of the template follows from its own grey and from those beside it.
#pragma once
#include <span>
#include <vector>

#include "core/image.h"

namespace kvx {

// Per voxel: the darkest grey of the 27 voxels around it, its own, the brightest. A voxel between fat and air
// is as grey as muscle, but has air beside it.
std::vector<Eigen::Vector3f> SurroundedGreys(const Volume& volume);

// The scan's mean grey as a smooth function of those three.
class GreyTable {
 public:
  // `shown`: the scan's greys at the same places (where VBD puts them); not a number where it shows nothing.
  GreyTable(std::span<const Eigen::Vector3f> greys, std::span<const float> shown);
  float operator()(const Eigen::Vector3f& greys) const;

 private:
  PointVox At(const Eigen::Vector3f& greys) const;
  void Refine();
  void AddMeans(std::span<const Eigen::Vector3f> greys, std::span<const float> shown, double few);

  float low_ = 0, high_ = 1;
  Volume table_;  // over darkest, own, brightest
};

}  // namespace kvx
