// Raw voxels of any scalar type to floats and back.
#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "core/scan.h"

namespace kvx {

// Of files whose header is wrong about them, whatever the format.
inline constexpr char kHoldsTwice[] =
    "the file holds twice as many bytes as the voxels that its header describes, or more: its sizes or its "
    "type are wrong, or it holds several frames; convert the original images again";

// What files hold; 64-bit integers are read but never written.
enum class VoxelType { kUint8, kInt8, kUint16, kInt16, kUint32, kInt32, kUint64, kInt64, kFloat32, kFloat64 };

size_t BytesOf(VoxelType type);
VoxelType VoxelTypeOf(ScalarType type);

// value = slope * stored + intercept.
struct Rescale {
  double slope = 1, intercept = 0;
  bool IsIdentity() const { return slope == 1 && intercept == 0; }
};

// The type that rescaled values are written back as:
// the narrowest that holds them all, by what the stored type can hold.
ScalarType StoredAs(VoxelType type, const Rescale& rescale);

// Appends the voxels in `bytes` (native byte order), "not a number" among them. Throws InputError for
// infinite values and for 64-bit integers that do not fit in 32 bits.
void AppendRescaled(VoxelType type, const Rescale& rescale, std::span<const char> bytes,
                    std::vector<float>& out);
// What programs that move a scan write as "not a number" was not measured: `filling` in its place.
void FillUnmeasured(std::span<float> values, float filling);
// Of those that are numbers; throws InputError where none is.
float SmallestMeasured(std::span<const float> values);
// Rounds (integer types) and clamps to the type.
std::string Packed(ScalarType type, std::span<const float> values);
void AppendPacked(ScalarType type, std::span<const float> values, std::string& bytes);
void SwapBytes(std::span<char> bytes, size_t width);

// Throws InputError unless sizes are at least 2, the product fits, the spacing and direction make sense and
// the whole is as large as part of a body may be; what the file claims must also be possible for
// `available_bytes` of voxel data (0: unknown).
void RequirePlausible(const Grid& grid, VoxelType type, double available_bytes);

}  // namespace kvx
