// The border of a CT bone that was found on large voxels, on smaller ones.
#pragma once
#include "pipeline/segmentation/strokes/found_bone.h"

namespace kvx {

struct FinerBorder {
  const Volume& scan_hu;
  const LabelMap& strokes;
  double diagonal_mm = 0;  // of the box of the bone's strokes
  double first_mm = 0;     // edge of the voxels that the bone was found on first

  // `found`: on blocks of `from` voxels that begin at found.box.low. The result is on blocks of `to`, which
  // are half as long along some axes, in a box that fits the bone. Only what lies near the border is looked
  // at.
  FoundBone Of(const FoundBone& found, const Eigen::Vector3i& from, const Eigen::Vector3i& to) const;
};

}  // namespace kvx
