// The scanner: samples a posed body on a voxel grid with partial volume, then adds gain, bias field and
// Rician noise.
#pragma once
#include "core/host/progress.h"
#include "core/image.h"
#include "pipeline/phantom/anatomy/tissue_intensity.h"
#include "pipeline/phantom/motion/composite_motion.h"

namespace kvx::phantom {

// Voxels of all scans of a study, in the anatomy frame; voxel 0, 0, 0 is the corner with the smallest
// coordinates.
struct ScanGrid {
  Eigen::Vector3i size = Eigen::Vector3i::Zero();
  Eigen::Vector3d spacing_mm = Eigen::Vector3d::Ones();

  Eigen::Vector3d Origin() const {
    return -0.5 * spacing_mm.cwiseProduct((size.array() - 1).matrix().cast<double>());
  }
  Eigen::Vector3d At(const Eigen::Vector3d& voxel) const { return Origin() + spacing_mm.cwiseProduct(voxel); }
  bool Sees(const Eigen::Vector3d& x) const;  // within the hull of voxel centres
  Grid World() const;  // LPS, for files: their NIfTI affine is then diagonal and positive
};

struct ScanImages {
  Volume intensities;  // 0..255
  Mask valid;          // 1: air, or material that the template scan sees too
};

struct Scanner {
  ScanGrid grid;
  double noise_sigma = 6;
  uint64_t seed = 0;
};

// `scan` numbers the scans of a study: each has its own gain, bias field and noise.
ScanImages Acquire(const Scanner& scanner, int scan, const RigidTransform& scan_from_posed,
                   const CompositeMotion& motion, const MaterialMap& material, double fluid_intensity,
                   const Progress& progress);

}  // namespace kvx::phantom
