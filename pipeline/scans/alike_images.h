// Two images whose slices are thick along unlike directions, seen as if their voxels were alike: along each
// direction the sharper one is blurred by what the other shows less of.
#pragma once
#include <vector>

#include "core/rigid_transform.h"
#include "pipeline/scans/cubic_image.h"

namespace kvx {

// How each of two images has to be blurred; columns are directions in the image's world, as long as the
// blur's standard deviation in mm.
struct Likening {
  Eigen::Matrix3d a_sd_mm = Eigen::Matrix3d::Zero(), b_sd_mm = Eigen::Matrix3d::Zero();
  double voxel_mm3 = 0;  // of a voxel that shows as much as either image does then
};
// `b_from_a` lays one over the other.
Likening Liken(const Grid& a, const Grid& b, const RigidTransform& b_from_a);
// The most that Liken blurs either along any direction, however one lies in the other.
double MostBlurSdMm(const Grid& a, const Grid& b);
// Of two images without thick slices neither is blurred.
Likening LikenThickSlices(const Grid& a, const Grid& b, const RigidTransform& b_from_a);

// What a blurred image is the weighted mean of.
struct BlurTap {
  Eigen::Vector3d away_voxels;
  double weight;
};
// `sd_mm`: as in Likening; what is less than `least_sd_voxels` along a column is left out. Taps lie at least
// `least_reach_voxels` apart: nearer ones, read linearly, would blur more than they should.
std::vector<BlurTap> BlurTaps(const Grid& grid, const Eigen::Matrix3d& sd_mm, double least_sd_voxels,
                              double least_reach_voxels);

// An image blurred along directions that need not be its axes. Refers to the image.
class BlurredImage {
 public:
  BlurredImage(const CubicImage& image, const Eigen::Matrix3d& sd_mm);  // as in Likening

  // As CubicImage::At.
  bool At(const Eigen::Vector3d& p_in_voxels, double& value, Eigen::Vector3d& gradient) const;
  bool blurs() const { return taps_.size() > 1; }
  const CubicImage& image() const { return image_; }
  const Grid& grid() const { return image_.grid(); }

 private:
  const CubicImage& image_;
  std::vector<BlurTap> taps_;
};

}  // namespace kvx
