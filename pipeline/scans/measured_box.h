// What a scan's grid holds but nobody measured: planes at its sides, filled up with one value by a program
// that moved the scan or made it larger.
#pragma once
#include "core/scan.h"
#include "core/voxels/voxel_box.h"

namespace kvx {

// Without the planes of one value at every side, where what begins behind them is cut off: a limb, or the
// noise of air. Air of one value (masked) beside a surface that curves away is taken for measured.
VoxelBox MeasuredBoxOf(const Volume& scan);

// Within its own measured box.
OwnOrLent<Volume> Measured(const Volume& scan);
OwnOrLent<Scan> Measured(const Scan& scan);

}  // namespace kvx
