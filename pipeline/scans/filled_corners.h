// What a scan's grid holds beyond its field of view: corners, filled up with one value by a program that
// turned the scan.
#pragma once
#include <string>

#include "core/image.h"

namespace kvx {

// 1 there and up to two voxels beside it, which mix. Empty (no voxels) where nothing was filled up, or where
// it cannot be told from air: the one value counts as filling where air that is not of it lies beside.
// `modality` as Scan has it; filled sides (measured_box.h) have been left out.
Mask FilledCorners(const Volume& scan, const std::string& modality);

// The scan with the value of air in the place of a filling that is darker than air; what lies beside it
// stays.
Volume WithAirInCorners(Volume scan, const std::string& modality);

}  // namespace kvx
