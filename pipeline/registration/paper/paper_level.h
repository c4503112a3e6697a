// One resolution of the published method: initialised template and scan on the scan's grid, and its blocks.
#pragma once
#include "core/image.h"
#include "kernels/block_level.h"
#include "kernels/device/backend.h"

namespace kvx {

// V^s and V^t of Algorithm 1 at full resolution: the template carried into the scan's pose by VBD, and the
// scan.
struct PaperPair {
  Volume source, target;  // on one grid, 0..255
  Mask counts;            // where the source shows something
  Mask bone;              // of the posed template
};

using VoxelShifts = Image<Eigen::Vector3f>;  // D of eq. 3: V^s is read at p + D(p), in voxels of its grid

struct PaperLevel {
  int number = 0;           // the paper's block level b: 2^b blocks of this size along 256 voxels
  int template_voxels = 1;  // per axis, in one voxel of the level
  Volume source, target;    // source as it was at the start
  Mask counts, bone;

  // MI where blocks are at least 32 voxels of the scan wide, SSD below.
  bool by_information() const { return kBlockVoxels * template_voxels >= 32; }
};

// Blocks of 32, 16 and 8 voxels of the scan, each at the resolution where it has 8; from coarse to fine.
std::vector<PaperLevel> MakePaperLevels(const PaperPair& pair, Backend& backend);
// D of a level on the next finer one.
VoxelShifts RefinedShifts(const VoxelShifts& coarse, const Grid& fine);
// V^s deformed by D.
Volume DeformedSource(const PaperLevel& level, const VoxelShifts& shifts);
float DeformedSourceAt(const PaperLevel& level, const VoxelShifts& shifts, size_t voxel);

}  // namespace kvx
