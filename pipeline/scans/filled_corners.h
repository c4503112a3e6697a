// What a scan's grid holds beyond its field of view: corners, filled up with one value by a program that
// turned the scan, or by a scanner whose view is round.
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

// What no scanner measures, also where no air lies beside it: CT below air becomes -1024, in other scans a
// corner's value that is far from the others (ZeroInPlaceOf) what no signal reads as.
Volume WithoutImpossibleFilling(Volume scan, const std::string& modality);

}  // namespace kvx
