// Conversion voxel by voxel; one template per direction, chosen by type.
#include "pipeline/io/voxel_values.h"

#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <limits>

#include "core/errors.h"
#include "core/farthest_place.h"

namespace kvx {
namespace {

// Of a volume's longest side: beyond, its unit is another.
constexpr double kSmallestMm = 1, kLargestMm = 3000;
// Of a voxel's sides: scanners of fingers resolve 0.005 mm, and what is wider than 50 mm shows no bone.
constexpr double kNarrowestMm = 0.002, kWidestMm = 50;

template <class Visitor>
decltype(auto) Visit(VoxelType type, Visitor&& visitor) {
  switch (type) {
    case VoxelType::kUint8:
      return visitor(uint8_t{});
    case VoxelType::kInt8:
      return visitor(int8_t{});
    case VoxelType::kUint16:
      return visitor(uint16_t{});
    case VoxelType::kInt16:
      return visitor(int16_t{});
    case VoxelType::kUint32:
      return visitor(uint32_t{});
    case VoxelType::kInt32:
      return visitor(int32_t{});
    case VoxelType::kUint64:
      return visitor(uint64_t{});
    case VoxelType::kInt64:
      return visitor(int64_t{});
    case VoxelType::kFloat32:
      return visitor(float{});
    case VoxelType::kFloat64:
      break;
  }
  return visitor(double{});
}

template <class T>
void RequireFits(T value) {
  if constexpr (std::is_integral_v<T> && sizeof(T) == 8) {
    const double v = double(value);
    if (v < -2147483648.0 || v > 4294967295.0) {
      throw InputError(
          "the volume holds 64-bit integers that do not fit in 32 bits; save it as a 32-bit type");
    }
  }
}

// Adding it leaves a float without room for a fraction: the sum is rounded to the nearest whole number,
// halves to even.
constexpr float kRoundsFloats = 12582912.0f;  // 1.5 * 2^23; for values within 2^22 of 0

template <class T>
T Clamped(float value) {
  if constexpr (std::is_floating_point_v<T>) {
    return T(value);
  } else if constexpr (sizeof(T) <=
                       2) {  // without a call or a branch: a posed volume passes here on its way out
    const float above =
        value > float(std::numeric_limits<T>::lowest()) ? value : float(std::numeric_limits<T>::lowest());
    const float within =
        above < float(std::numeric_limits<T>::max()) ? above : float(std::numeric_limits<T>::max());
    return T(int(within + kRoundsFloats - kRoundsFloats));
  } else {
    const double rounded = std::nearbyint(double(value));
    if (!(rounded > double(std::numeric_limits<T>::lowest()))) return std::numeric_limits<T>::lowest();
    if (rounded >= double(std::numeric_limits<T>::max())) return std::numeric_limits<T>::max();
    return T(rounded);
  }
}

bool IsWhole(double value) { return std::isfinite(value) && value == std::floor(value); }

ScalarType Plain(VoxelType type) {
  switch (type) {
    case VoxelType::kUint8:
      return ScalarType::kUint8;
    case VoxelType::kInt8:
      return ScalarType::kInt8;
    case VoxelType::kUint16:
      return ScalarType::kUint16;
    case VoxelType::kInt16:
      return ScalarType::kInt16;
    case VoxelType::kUint32:
    case VoxelType::kUint64:
      return ScalarType::kUint32;
    case VoxelType::kInt32:
    case VoxelType::kInt64:
      return ScalarType::kInt32;
    case VoxelType::kFloat32:
      return ScalarType::kFloat32;
    case VoxelType::kFloat64:
      break;
  }
  return ScalarType::kFloat64;
}

}  // namespace

size_t BytesOf(VoxelType type) {
  return Visit(type, [](auto zero) { return sizeof zero; });
}

VoxelType VoxelTypeOf(ScalarType type) {
  switch (type) {
    case ScalarType::kUint8:
      return VoxelType::kUint8;
    case ScalarType::kInt8:
      return VoxelType::kInt8;
    case ScalarType::kUint16:
      return VoxelType::kUint16;
    case ScalarType::kInt16:
      return VoxelType::kInt16;
    case ScalarType::kUint32:
      return VoxelType::kUint32;
    case ScalarType::kInt32:
      return VoxelType::kInt32;
    case ScalarType::kFloat32:
      return VoxelType::kFloat32;
    case ScalarType::kFloat64:
      break;
  }
  return VoxelType::kFloat64;
}

ScalarType StoredAs(VoxelType type, const Rescale& rescale) {
  const ScalarType plain = Plain(type);
  if (rescale.IsIdentity() || plain == ScalarType::kFloat64) return plain;
  if (plain == ScalarType::kFloat32 || !IsWhole(rescale.slope) || !IsWhole(rescale.intercept))
    return ScalarType::kFloat32;
  const auto [low, high] = Visit(VoxelTypeOf(plain), [&](auto zero) {
    using T = decltype(zero);
    const double a = rescale.slope * double(std::numeric_limits<T>::lowest()) + rescale.intercept;
    const double b = rescale.slope * double(std::numeric_limits<T>::max()) + rescale.intercept;
    return std::pair(std::min(a, b), std::max(a, b));
  });
  if (low >= -32768 && high <= 32767) return ScalarType::kInt16;
  if (low >= -2147483648.0 && high <= 2147483647.0) return ScalarType::kInt32;
  return ScalarType::kFloat32;
}

void AppendRescaled(VoxelType type, const Rescale& rescale, std::span<const char> bytes,
                    std::vector<float>& out) {
  Visit(type, [&](auto zero) {
    using T = decltype(zero);
    for (size_t at = 0; at + sizeof(T) <= bytes.size(); at += sizeof(T)) {
      T stored;
      std::memcpy(&stored, bytes.data() + at, sizeof stored);
      RequireFits(stored);
      const float value =
          rescale.IsIdentity() ? float(stored) : float(rescale.slope * double(stored) + rescale.intercept);
      if (std::isinf(value)) {
        throw InputError(
            "the volume holds voxels that are infinite; replace them, for instance by the background");
      }
      out.push_back(value);
    }
  });
}

void FillUnmeasured(std::span<float> values, float filling) {
  for (float& value : values) value = std::isnan(value) ? filling : value;
}

float SmallestMeasured(std::span<const float> values) {
  float smallest = std::numeric_limits<float>::infinity();
  for (const float value : values) smallest = value < smallest ? value : smallest;  // false for NaN
  if (std::isinf(smallest))
    throw InputError("no voxel of the volume is a number; the file is damaged or empty");
  return smallest;
}

void AppendPacked(ScalarType type, std::span<const float> values, std::string& bytes) {
  Visit(VoxelTypeOf(type), [&](auto zero) {
    using T = decltype(zero);
    const size_t begin = bytes.size();
    bytes.resize(begin + values.size() * sizeof(T));
    char* out = bytes.data() + begin;
    for (size_t v = 0; v < values.size(); ++v) {
      const T stored = Clamped<T>(values[v]);
      std::memcpy(out + v * sizeof(T), &stored, sizeof stored);
    }
  });
}

std::string Packed(ScalarType type, std::span<const float> values) {
  std::string bytes;
  AppendPacked(type, values, bytes);
  return bytes;
}

void SwapBytes(std::span<char> bytes, size_t width) {
  for (size_t at = 0; at + width <= bytes.size(); at += width) {
    for (size_t b = 0; b < width / 2; ++b) std::swap(bytes[at + b], bytes[at + width - 1 - b]);
  }
}

void RequirePlausible(const Grid& grid, VoxelType type, double available_bytes) {
  if ((grid.size.array() < 1).any())
    throw InputError("the volume's header gives a size that is not positive");
  if ((grid.size.array() < 2).any()) {
    throw InputError(
        "the file holds a single slice or line; give a 3-D volume with at least 2 voxels along every axis");
  }
  const double voxels = grid.size.cast<double>().prod();
  if (voxels > 2147483647.0)
    throw InputError("the volume's header gives more than 2147483647 voxels; crop or resample it");
  if (available_bytes > 0 && voxels * double(BytesOf(type)) > available_bytes) {
    throw InputError(
        "the file is too short for the volume its header describes; it is cut off or its header is wrong");
  }
  if (!grid.origin.lps.allFinite())
    throw InputError("the volume's header gives an origin that is not finite");
  if (LiesTooFar(grid.origin)) {
    throw InputError(
        "the volume's header gives an origin that is more than a kilometre away; correct it, it is in mm");
  }
  Validate(grid);
  const double longest_mm = grid.spacing_mm.cwiseProduct(grid.size.cast<double>()).maxCoeff();
  if (longest_mm < kSmallestMm || longest_mm > kLargestMm) {
    throw InputError(
        "the volume's header makes it smaller than a millimetre or longer than three metres; correct its "
        "voxel spacing, which is in mm");
  }
  if (grid.spacing_mm.minCoeff() < kNarrowestMm || grid.spacing_mm.maxCoeff() > kWidestMm) {
    char text[200];
    std::snprintf(text, sizeof text,
                  "the volume's header gives voxels of %.3g x %.3g x %.3g mm, and no scan of bones has any "
                  "narrower than %g or wider than %g mm; correct its voxel spacing, which is in mm",
                  grid.spacing_mm.x(), grid.spacing_mm.y(), grid.spacing_mm.z(), kNarrowestMm, kWidestMm);
    throw InputError(text);
  }
}

}  // namespace kvx
