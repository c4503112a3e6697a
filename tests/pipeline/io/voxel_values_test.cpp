// Floats packed as a scan's own type: rounded to the nearest, halves to even, and clamped.
#include "pipeline/io/voxel_values.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

namespace kvx {
namespace {

template <class T>
std::vector<T> PackedAs(ScalarType type, const std::vector<float>& values) {
  const std::string bytes = Packed(type, values);
  std::vector<T> out(bytes.size() / sizeof(T));
  std::memcpy(out.data(), bytes.data(), bytes.size());
  return out;
}

TEST(VoxelValues, ArePackedToTheNearestWholeNumberOfTheirType) {
  EXPECT_EQ(PackedAs<int16_t>(ScalarType::kInt16, {0.5f, 1.5f, -0.5f, -1.5f, 2.49f, -1023.75f, 32766.6f}),
            (std::vector<int16_t>{0, 2, 0, -2, 2, -1024, 32767}));
  EXPECT_EQ(PackedAs<int16_t>(ScalarType::kInt16, {1e9f, -1e9f, INFINITY, -INFINITY, NAN}),
            (std::vector<int16_t>{32767, -32768, 32767, -32768, -32768}));
  EXPECT_EQ(PackedAs<uint8_t>(ScalarType::kUint8, {-3.0f, 254.5f, 255.4f, 300.0f, NAN}),
            (std::vector<uint8_t>{0, 254, 255, 255, 0}));
  EXPECT_EQ(PackedAs<uint16_t>(ScalarType::kUint16, {65534.5f, 65535.5f, -1.0f}),
            (std::vector<uint16_t>{65534, 65535, 0}));
  EXPECT_EQ(PackedAs<float>(ScalarType::kFloat32, {0.25f, -7.0f}), (std::vector<float>{0.25f, -7.0f}));
}

TEST(VoxelValues, AreAppendedToWhatIsThere) {
  std::string bytes = "head";
  AppendPacked(ScalarType::kUint8, std::vector<float>{65.0f, 66.0f}, bytes);
  EXPECT_EQ(bytes, "headAB");
}

}  // namespace
}  // namespace kvx
