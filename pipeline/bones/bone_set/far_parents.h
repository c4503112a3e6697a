// Bones that lie far from their parent in the study's tree: the tree is not that of the joints, or an end
// lacks.
#pragma once
#include <vector>

#include "core/bone.h"
#include "core/study.h"

namespace kvx {

// Some voxels of each bone's surface. Index as in BoneSet.
class BoneSurfaces {
 public:
  explicit BoneSurfaces(const BoneSet& bones);
  double ApartMm(int a, int b) const;  // the least distance of those voxels

 private:
  std::vector<std::vector<Eigen::Vector3d>> points_mm_;
};

constexpr double kFarMm = 10;  // no joint is so wide

struct FarParent {
  int bone;  // index as in BoneSet
  double apart_mm;
};
// Bones more than kFarMm from their parent that have another bone, not one of their children, three times
// nearer: the tree is not that of the joints.
std::vector<FarParent> FarParents(const BoneSet& bones, const BoneSurfaces& surfaces);

// Bones that by the region's preset meet their parent and whose surface is more than kFarMm from it, however
// thick voxels are: an end of one of the two is missing, or a name is wrong. None of a custom region.
std::vector<FarParent> PartedJoints(const BoneSet& bones, const BoneSurfaces& surfaces, Region region);

}  // namespace kvx
