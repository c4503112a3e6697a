// A dark shell in a bright scan, and boxes that lie on it in full, in part or not at all.
#include "pipeline/segmentation/mr/search/clearest_bone.h"

#include <gtest/gtest.h>

namespace kvx {
namespace {

constexpr double kLevel = 200;

Grid World() {
  Grid grid;
  grid.size = {30, 15, 15};
  return grid;
}

// From the middle, along the long axis and the others.
Eigen::Array3i From(const Eigen::Vector3i& voxel) { return (voxel.array() - Eigen::Array3i(14, 7, 7)).abs(); }

// Half lengths of the bone and its shell: 9, 3 and 3.
Volume Scan() {
  Volume scan(World(), 160.0f);
  for (size_t v = 0; v < scan.values.size(); ++v) {
    const Eigen::Array3i from = From(scan.grid.Ijk(v));
    const bool inside = (from <= Eigen::Array3i(8, 2, 2)).all();
    if ((from <= Eigen::Array3i(9, 3, 3)).all() && !inside) scan.values[v] = 120;
  }
  return scan;
}

template <class In>
FoundBone Candidate(In&& in) {
  FoundBone bone{1, {Eigen::Vector3i::Zero(), World().size}, Mask(World()), Image<float>(World())};
  for (size_t v = 0; v < bone.mask.values.size(); ++v) bone.mask.values[v] = in(World().Ijk(v));
  return bone;
}

bool InBone(const Eigen::Vector3i& v) { return (From(v) <= Eigen::Array3i(9, 3, 3)).all(); }

TEST(ClearestBone, IsTheWholeOneNotItsHalfNorOneThatLeaks) {
  const std::vector<FoundBone> candidates{
      Candidate([](const auto& v) { return InBone(v) && v.x() < 14; }),
      Candidate([](const auto& v) { return InBone(v) || (v.x() < 12 && v.y() >= 10); }),
      Candidate(InBone),
      Candidate([](const auto& v) { return InBone(v) && From(v).y() < 2; }),
  };
  EXPECT_EQ(ClearestBone(Scan(), kLevel, candidates), 2u);
}

TEST(ClearestBone, IsTheFirstOfEqualsAndSomethingRatherThanNothing) {
  const FoundBone nothing = Candidate([](const auto&) { return false; });
  EXPECT_EQ(ClearestBone(Scan(), kLevel, std::vector{Candidate(InBone), Candidate(InBone)}), 0u);
  EXPECT_EQ(ClearestBone(Scan(), kLevel, std::vector{nothing, Candidate(InBone)}), 1u);
}

}  // namespace
}  // namespace kvx
