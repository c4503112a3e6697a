// The tissue of a region as an elastic solid between its bones.
#pragma once
#include "core/bone.h"
#include "core/host/progress.h"
#include "pipeline/registration/region/work_region.h"
#include "pipeline/registration/tissue/tissue_contact.h"

namespace kvx {

class ElasticTissue {
 public:
  // `beyond_coat_mm`: as BeyondBoneCoatMm gives it; referred to.
  ElasticTissue(const LabelMap& bone_labels, const Mask& body, const Volume& beyond_coat_mm,
                const WorkRegion& region, Backend& backend);

  // Moves every soft voxel (given in scan mm) towards where the tissue is at ease, and out of other tissue
  // that it would lie in. Bones stay; air moves with the tissue nearest to it. `holds`: empty, or per cell of
  // 2 x 2 x 2 voxels how firmly each of its voxels is held where it is (1/mm^2: second derivative of its
  // energy in its place), in units of the tissue's own stiffness. Of `progress` it asks alone whether to go
  // on.
  void Relax(std::span<const Eigen::Matrix3f> holds, const Progress& progress,
             std::vector<Eigen::Vector3f>& scan_mm) const;

 private:
  ElasticLattice Empty(int step) const;
  std::vector<float> CoatStiffness() const;
  ElasticLattice Subsampled(const std::vector<Eigen::Vector3f>& scan_mm, int step) const;
  void AddMoved(const ElasticLattice& lattice, int step, std::vector<Eigen::Vector3f>& scan_mm) const;
  void RelaxBesideBones(std::span<const Eigen::Matrix3f> holds, const std::vector<Eigen::Vector3f>& held_mm,
                        std::vector<Eigen::Vector3f>& scan_mm) const;
  void CarryAir(const std::vector<Eigen::Vector3f>& before, std::vector<Eigen::Vector3f>& scan_mm) const;

  ElasticSweeps sweeps_;
  Grid grid_;
  std::vector<NodeKind> kinds_;  // absent: air
  const Volume& beyond_coat_mm_;
  TissueContact contact_;
  std::vector<uint32_t> nearest_tissue_;
  std::vector<uint32_t> beside_bones_;  // soft voxels
};

}  // namespace kvx
