// Bones stretch one by one; what is bone decides together.
#include "pipeline/bones/judge/another_size.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cstdio>

#include "core/host/parallel.h"
#include "pipeline/bones/judge/bone_stretch.h"

namespace kvx {
namespace {

// Scanners distort by a hundredth or two; bones of two people differ by more in some direction.
constexpr double kOddStretch = 0.035;
constexpr double kOddVoxels = 0.5;  // that the surface lies off: a blurred border seems to lie elsewhere
constexpr double kOddPart = 0.3;    // of the bones' voxels: one of two large bones may be alike in two people
constexpr double kSureDeviations = 5;   // as stated; in noise the true ones are larger
constexpr double kAlike = 0.5;          // of a misfit is left at most where one of the grid explains it
constexpr size_t kTellingVoxels = 300;  // of a bone: those of smaller ones are lost in noise

struct StretchedBone {
  double voxels;
  BoneStretch stretch;
  Eigen::Matrix3d half_voxels;  // the length of its product with a unit vector: half the bone's, in voxels
  Eigen::Matrix3d grid_from_template;  // turn, to the axes of the scan's grid
};

std::vector<StretchedBone> StretchesOf(const BoneSet& bones, const SeenTemplate& seen, const CubicImage& scan,
                                       const BoneFits& fits) {
  std::vector<std::optional<BoneStretch>> stretches(fits.size());
  ParallelFor(fits.size(), [&](size_t b) {
    if (!fits[b].Doubtful() && bones.bones[b].voxels >= kTellingVoxels)
      stretches[b] = StretchOf(seen.tissue[b], seen.image, scan, fits[b].scan_from_template);
  });
  const double voxel_mm = std::max(bones.labels.grid.MeanSpacingMm(), scan.grid().MeanSpacingMm());
  std::vector<StretchedBone> out;
  for (size_t b = 0; b < fits.size(); ++b) {
    if (!stretches[b]) continue;
    const Bone& bone = bones.bones[b];
    out.push_back(
        {double(bone.voxels), *stretches[b],
         (0.5 / voxel_mm * bone.box.extent_mm).asDiagonal() * bone.box.axes.transpose(),
         scan.grid().direction.transpose() * fits[b].scan_from_template.rotation.toRotationMatrix()});
  }
  return out;
}

// How far from 1 the stretch is where it is so for certain; 0 where it may be 1.
double Oddness(const StretchedBone& bone) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> along(bone.stretch.scan_of_template);
  double most = 0;
  for (int a = 0; a < 3; ++a) {
    const Eigen::Vector3d axis = along.eigenvectors().col(a);
    const double odd = std::abs(along.eigenvalues()[a] - 1),
                 surely = odd - kSureDeviations * SdAlong(bone.stretch, axis);
    if (surely > kOddStretch && surely * (bone.half_voxels * axis).norm() > kOddVoxels)
      most = std::max(most, odd);
  }
  return most;
}

bool ManyAreOdd(const std::vector<StretchedBone>& bones) {
  double odd = 0, all = 0;
  for (const StretchedBone& bone : bones) odd += Oddness(bone) > 0 ? bone.voxels : 0, all += bone.voxels;
  return odd > kOddPart * all;
}

// Along the axes of the scan's grid, the mean of all bones.
Eigen::Vector3d StretchOfGrid(const std::vector<StretchedBone>& bones) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double all = 0;
  for (const StretchedBone& bone : bones) {
    const Eigen::Matrix3d& turn = bone.grid_from_template;
    sum += bone.voxels * (turn * bone.stretch.scan_of_template * turn.transpose()).diagonal();
    all += bone.voxels;
  }
  return sum / all;
}

// As the bones would be if the grid were not stretched so.
std::vector<StretchedBone> Without(const Eigen::Vector3d& grid_stretch, std::vector<StretchedBone> bones) {
  for (StretchedBone& bone : bones) {
    const Eigen::Matrix3d& turn = bone.grid_from_template;
    const Eigen::Vector3d odd = grid_stretch.array() - 1;
    bone.stretch.scan_of_template -= turn.transpose() * odd.asDiagonal() * turn;
  }
  return bones;
}

// How far the bones are from the size they should have, squared.
double Misfit(const std::vector<StretchedBone>& bones) {
  double sum = 0;
  for (const StretchedBone& bone : bones)
    sum += bone.voxels * (bone.stretch.scan_of_template - Eigen::Matrix3d::Identity()).squaredNorm();
  return sum;
}

std::string WhyOf(const std::vector<StretchedBone>& bones) {
  char text[280];
  const Eigen::Vector3d grid = StretchOfGrid(bones);
  if (bones.size() > 1 && Misfit(Without(grid, bones)) < kAlike * kAlike * Misfit(bones)) {
    std::snprintf(text, sizeof text,
                  "all bones alike, as if its voxels were given as %.2f, %.2f and %.2f times as long as they "
                  "are; check the voxel sizes of this scan and of the template",
                  grid.x(), grid.y(), grid.z());
    return text;
  }
  double most = 0;
  for (const StretchedBone& bone : bones) most = std::max(most, Oddness(bone));
  std::snprintf(
      text, sizeof text,
      "by up to %.0f %%; it may be another person's, its voxel sizes may be wrong, or the limb moved while "
      "it was scanned: check, or leave it out of the study",
      100 * most);
  return text;
}

}  // namespace

void NameAnotherSize(const BoneSet& bones, const SeenTemplate& seen, const CubicImage& scan, BoneFits& fits) {
  const std::vector<StretchedBone> stretched = StretchesOf(bones, seen, scan, fits);
  if (!ManyAreOdd(stretched)) return;
  DoubtAll(Doubt::kAnotherSize,
           "the scan shows the bones in another size than the template, " + WhyOf(stretched), fits);
}

}  // namespace kvx
