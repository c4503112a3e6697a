// Where template and scan look different although they are registered.
#pragma once
#include <span>
#include <vector>

#include "kernels/block_level.h"

namespace kvx {

// Of a cell of 2 x 2 x 2 voxels of a level: squares of intensity differences by the weight of a measurement,
// which several voxels may share (BlockLevel::voxels_a_measurement), and the voxels that count.
struct CellDisagreement {
  float squares = 0, count = 0;
};

// Cell by cell; `scan_mm`: where every voxel of the level lies.
std::vector<CellDisagreement> DisagreementOfCells(const BlockLevel& level,
                                                  std::span<const Eigen::Vector3f> scan_mm);

// Per cell, the squared difference per weight over the 27 cells around it: in parts of the variance that the
// weights stand for. 0 where nothing there counts.
std::vector<float> DisagreementBeside(const BlockLevel& level, std::span<const Eigen::Vector3f> scan_mm);

// Per cell, the squared difference per weight about it, a Gaussian of two cells wide, over what it is in well
// registered tissue; 0 where nothing near counts. No gain or bias is fitted to the place, so that tissue that
// only one of the images has shows.
Volume DisagreementAround(const BlockLevel& level, std::span<const Eigen::Vector3f> scan_mm);

}  // namespace kvx
