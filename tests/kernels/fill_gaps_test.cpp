// Gaps inside the body are closed linearly; wide ones, owned air and the outside stay.
#include "kernels/fill_gaps.h"

#include <gtest/gtest.h>

#include <random>

#include "kernels/reference/fill_gaps.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

constexpr uint32_t kNobody = 0xFFFFFFFFu, kBody = 7u, kMargin = (1u << 30) | 7u;
constexpr float kAir = -3.0f;

Volume OnDevice(const std::vector<uint32_t>& owner, const Volume& values) {
  Backend& backend = SharedBackend();
  const OwnerVolume owners(backend, std::span(owner));
  DeviceBuffer<float> buffer(backend, std::span(values.values));
  const FillGaps fill(backend);
  fill(backend.queue(), owners, values.grid, kAir, buffer);
  Volume out = values;
  buffer.Download(backend.queue(), out.values);
  return out;
}

// A row of voxels: values 10, 20, ... where somebody owns them.
struct RowWorld {
  Volume values;
  std::vector<uint32_t> owner;
  explicit RowWorld(std::vector<uint32_t> owners) : values(ObliqueGrid({int(owners.size()), 1, 1})), owner(std::move(owners)) {
    for (size_t i = 0; i < owner.size(); ++i) values.values[i] = owner[i] == kNobody ? kAir : 10.0f * float(i + 1);
  }
};

TEST(FillGaps, TwoVoxelsAreFilledLinearlyAndThreeAreLeft) {
  const RowWorld narrow({kBody, kNobody, kNobody, kBody, kNobody});
  EXPECT_THAT(OnDevice(narrow.owner, narrow.values).values,
              testing::Pointwise(testing::FloatNear(1e-4f), {10.0f, 20.0f, 30.0f, 40.0f, kAir}));
  const RowWorld wide({kBody, kNobody, kNobody, kNobody, kBody});
  EXPECT_EQ(OnDevice(wide.owner, wide.values).values, wide.values.values);
}

TEST(FillGaps, AirThatWasCarriedIsNotBridged) {
  const RowWorld fingers({kBody, kNobody, kMargin, kNobody, kBody});
  EXPECT_EQ(OnDevice(fingers.owner, fingers.values).values, fingers.values.values);
}

TEST(FillGaps, AgreesWithItsTwin) {
  Volume values(ObliqueGrid({23, 19, 17}));
  std::vector<uint32_t> owner(values.values.size());
  std::mt19937 random(5);
  for (size_t v = 0; v < owner.size(); ++v) {
    const unsigned roll = random() % 10;
    owner[v] = roll < 6 ? kBody : roll < 7 ? kMargin : kNobody;
    values.values[v] = owner[v] == kNobody ? kAir : float(random() % 1000);
  }
  const Volume device = OnDevice(owner, values);
  reference::FillGaps(owner, kAir, values);
  EXPECT_THAT(device.values, testing::Pointwise(testing::FloatNear(1e-2f), values.values));
}

}  // namespace
}  // namespace kvx
