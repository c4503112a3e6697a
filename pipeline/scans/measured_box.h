// What a scan's grid holds but nobody measured: planes at its sides, filled up with one value by a program
// that moved the scan or made it larger.
#pragma once
#include "core/image.h"

namespace kvx {

struct MeasuredBox {
  Eigen::Vector3i first, last;  // voxels, both within
  bool Contains(const Eigen::Vector3i& p) const {
    return (p.array() >= first.array()).all() && (p.array() <= last.array()).all();
  }
};

// Without the planes of one value at every side, where what begins behind them is cut off: a limb, or the
// noise of air. Air of one value (masked) beside a surface that curves away is taken for measured.
MeasuredBox MeasuredBoxOf(const Volume& scan);

// The scan's voxels within.
Volume Within(const Volume& scan, const MeasuredBox& box);

// Within its own measured box.
Volume Measured(const Volume& scan);

}  // namespace kvx
