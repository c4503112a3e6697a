// The points of a bone and its margin at which template and scan are compared (eq. 1).
#pragma once
#include <vector>

#include "kernels/bone_scores.h"
#include "pipeline/bones/template/bone_shape.h"

namespace kvx {

struct BoneSamples {
  Eigen::Vector3d centre_mm;  // samples are relative to it
  std::vector<BoneSample> points;
  std::vector<float> weights;  // empty: all 1
};

// Up to `count` voxel centres of the bone and of a margin of `margin_mm` around it, without those that belong
// to other bones (these move on their own), at least half of them within `margin_mm` of the surface, where
// the contrast is. `values` may be coarser than the labels.
// With `everything`, other bones count as surroundings.
BoneSamples SampleBone(const BoneShape& shape, const LabelMap& labels, int label, const Volume& values,
                       double margin_mm, size_t count, bool everything = false);

VoxFromSample ToScanVoxels(const Grid& scan, const RigidTransform& scan_from_template,
                           const Eigen::Vector3d& centre_mm);

// Evidence for a pose in nats: the log likelihood ratio of gain-and-bias-free match against no relation, n/2
// log 1/(1 - r^2), with n independent samples, `inside` of which the scan saw.
double EvidenceNats(double correlation, double inside, double independent_samples);
constexpr double kWeakCorrelation = 0.55;  // below which a bone hardly matches the scan
// At most 0, what speaks against a pose where a bone is known to be in view: it matches to some extent at
// least, and r falls short of that, as Fisher's z (standard deviation 1 / sqrt n).
double WeakMatchNats(double correlation, double inside, double independent_samples);
// Neighbouring voxels say much the same: one independent sample in each cube of 4 voxels, between 8 and 100.
double IndependentSamples(const Bone& bone);

}  // namespace kvx
