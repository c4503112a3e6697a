// Floats packed as a scan's own type: rounded to the nearest, halves to even, and clamped.
#include "pipeline/io/voxel_values.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>

#include "core/errors.h"

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

template <class T>
std::vector<float> Rescaled(VoxelType type, const Rescale& rescale, T stored) {
  std::vector<float> out;
  const std::span<const char> bytes(reinterpret_cast<const char*>(&stored), sizeof stored);
  AppendRescaled(type, rescale, bytes, out);
  return out;
}

TEST(VoxelValues, OfSixtyFourBitsAreReadWhereTheyFitInThirtyTwo) {
  EXPECT_EQ(Rescaled<int64_t>(VoxelType::kInt64, {}, -2147483648), std::vector{-2147483648.0f});
  EXPECT_EQ(Rescaled<uint64_t>(VoxelType::kUint64, {}, 4294967295), std::vector{4294967296.0f});
  EXPECT_THROW(Rescaled<int64_t>(VoxelType::kInt64, {}, int64_t(1) << 40), InputError);
  EXPECT_THROW(Rescaled<int64_t>(VoxelType::kInt64, {}, -(int64_t(1) << 40)), InputError);
  EXPECT_THROW(Rescaled<uint64_t>(VoxelType::kUint64, {}, uint64_t(1) << 40), InputError);
}

TEST(VoxelValues, ThatAreInfiniteOrBecomeSoAreRefused) {
  EXPECT_THROW(Rescaled<float>(VoxelType::kFloat32, {}, INFINITY), InputError);
  EXPECT_THROW(Rescaled<float>(VoxelType::kFloat32, {}, -INFINITY), InputError);
  EXPECT_THROW(Rescaled<int32_t>(VoxelType::kInt32, {1e38, 0}, 10), InputError);
  EXPECT_EQ(Rescaled<int32_t>(VoxelType::kInt32, {1e38, 0}, 2), std::vector{2e38f});
  EXPECT_TRUE(std::isnan(Rescaled<float>(VoxelType::kFloat32, {}, NAN)[0]));
}

// What the stored type can hold, times the slope: of uint8 0 .. 255.
TEST(VoxelValues, AreWrittenBackAsTheNarrowestTypeThatHoldsAllThatTheyMayBe) {
  EXPECT_EQ(StoredAs(VoxelType::kUint8, {-128, 0}), ScalarType::kInt16);   // -32640
  EXPECT_EQ(StoredAs(VoxelType::kUint8, {-256, 0}), ScalarType::kInt32);   // -65280
  EXPECT_EQ(StoredAs(VoxelType::kUint8, {128, 127}), ScalarType::kInt16);  // 32767
  EXPECT_EQ(StoredAs(VoxelType::kUint8, {128, 128}), ScalarType::kInt32);
  EXPECT_EQ(StoredAs(VoxelType::kUint32, {2, 0}), ScalarType::kFloat32);
}

}  // namespace
}  // namespace kvx
