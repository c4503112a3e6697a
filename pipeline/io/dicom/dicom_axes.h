// The axes of a series' grid: headers give them as direction cosines, rounded, by some programs to two
// digits.
#pragma once
#include "pipeline/io/dicom/dicom_header.h"

namespace kvx {

// As columns: along a row, along a column, and at right angles to both. Where the cosines are rounded so
// roughly that `along_slices`, from the first slice to the last, is theirs too, the third is that: positions
// over a whole volume tell it better. Throws InputError for axes that are farther from right angles than
// rounding makes them.
Eigen::Matrix3d AxesOf(const DicomFrame& frame, const Eigen::Vector3d& along_slices);

}  // namespace kvx
