// The displacement of eight voxels, and the rigid motion of the bone that most of them belong to.
#include "pipeline/registration/result/bordered_field.h"

#include <array>

#include "core/bone_border.h"
#include "core/voxels/to_corner.h"

namespace kvx {
namespace {

struct Mean {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double weight = 0;

  void Add(double part, const Eigen::Vector3d& value) { sum += part * value, weight += part; }
  Eigen::Vector3d Value() const { return weight > 0 ? Eigen::Vector3d(sum / weight) : sum; }
};

}  // namespace

BorderedField::BorderedField(const DisplacementField& field, const BoneSet& bones,
                             PoseVector scan_from_template)
    : field_(field),
      labels_(bones.labels),
      bone_of_label_(BoneOfLabel(bones.bones)),
      scan_from_template_(std::move(scan_from_template)) {}

Eigen::Vector3d BorderedField::operator()(const PointMm& in_template) const {
  const Grid& grid = field_.grid;
  const Eigen::Vector3i last = grid.size.array() - 1;
  const Eigen::Vector3d p = grid.ToVox(in_template).ijk.cwiseMax(0.0).cwiseMin(last.cast<double>());
  const Eigen::Vector3i first = p.cast<int>();
  const Eigen::Vector3d beyond = p - first.cast<double>();
  std::array<double, 8> parts;
  std::array<int, 8> bones;
  std::array<size_t, 8> voxels;
  for (size_t corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3i offset = ToCorner(corner);
    const Eigen::Vector3i at = (first + offset).cwiseMin(last);
    parts[corner] = 1;
    for (int a = 0; a < 3; ++a) parts[corner] *= offset[a] ? beyond[a] : 1 - beyond[a];
    voxels[corner] = grid.Index(at.x(), at.y(), at.z());
    bones[corner] = bone_of_label_[labels_.values[voxels[corner]]];
  }
  const auto [bone, share] = ShareOfBone(parts, bones);
  Mean others, off_rigid;  // the second where a method moves bone in itself
  for (size_t corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3d move = field_.values[voxels[corner]].cast<double>();
    if (share == 0 || bones[corner] != bone) {
      others.Add(parts[corner], move);
    } else {
      const PointMm voxel = grid.ToMm(PointVox{grid.Ijk(voxels[corner]).cast<double>()});
      off_rigid.Add(parts[corner], voxel.lps + move - (scan_from_template_[size_t(bone)] * voxel).lps);
    }
  }
  const Eigen::Vector3d beside = in_template.lps + others.Value();
  if (share == 0) return beside;
  const Eigen::Vector3d with_bone = (scan_from_template_[size_t(bone)] * in_template).lps + off_rigid.Value();
  return share * with_bone + (1 - share) * beside;
}

}  // namespace kvx
