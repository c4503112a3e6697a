// The header of a NIfTI file: what of it matters to us, checked.
#pragma once
#include <string_view>

#include "pipeline/io/voxel_values.h"

namespace kvx {

struct NiftiHeader {
  Grid grid;  // LPS mm
  VoxelType type = VoxelType::kUint8;
  Rescale rescale;
  size_t voxel_offset = 0;  // bytes from the beginning of the (unpacked) file
  bool swapped = false;     // stored in the other byte order
};

constexpr size_t kLongestNiftiHeaderBytes = 540;  // NIfTI-2; NIfTI-1 needs 348
constexpr size_t kNifti1VoxelOffset = 352;        // without extensions

// `bytes`: the first kLongestNiftiHeaderBytes of the unpacked file, or fewer where it is shorter. Throws
// InputError.
NiftiHeader ParseNiftiHeader(std::string_view bytes);

}  // namespace kvx
