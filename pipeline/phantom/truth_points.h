// Material points drawn over the template's body, and where each pose takes them.
#pragma once
#include "pipeline/io/npz_file.h"
#include "pipeline/phantom/acquisition.h"

namespace kvx::phantom {

struct TruthPoint {
  Eigen::Vector3d rest;  // template, anatomy frame, mm
  Tissue tissue = Tissue::kAir;
  int bone = 0;         // label, 0: soft
  double joint_mm = 0;  // to the nearest articulation: the larger of the distances to its two bones
};

// Evenly over the body that the template scan sees; `motion` is any pose's (says where there is material).
std::vector<TruthPoint> DrawTruthPoints(const Anatomy& anatomy, const TissueModel& tissues,
                                        const ScanGrid& grid, const CompositeMotion& motion, int count,
                                        uint64_t seed);

struct TruthPositions {
  std::vector<Eigen::Vector3d> in_scan;  // anatomy frame of the scan, mm
  std::vector<uint8_t> in_fov,
      hidden;  // hidden: under a bone, or where another part of the body is what the scan shows
  double in_fov_share = 0, hidden_share = 0;
};
TruthPositions MoveTruthPoints(const std::vector<TruthPoint>& points, const CompositeMotion& motion,
                               const RigidTransform& scan_from_posed, const ScanGrid& grid);

// What is wrong with a pose's true map, by its soft truth points.
struct MapFaults {
  double folded_share = 0;       // turned inside out
  double overlapping_share = 0;  // in other tissue, see CompositeMotion::SharedDepthMm
  double overlap_mm = 0;         // the deepest of them
};
MapFaults FaultsOf(const std::vector<TruthPoint>& points, const CompositeMotion& motion);

NpyArrays TruthArrays(const std::vector<TruthPoint>& points, const TruthPositions& positions);

}  // namespace kvx::phantom
