// Folded maps come right, and maps without folds are left as they are.
#include "pipeline/registration/tissue/fold_repair.h"

#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>

#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

Eigen::Vector3d Rigid(const Eigen::Vector3d& x) {
  return Eigen::AngleAxisd(1.1, Eigen::Vector3d(1, 2, 3).normalized()) * x + Eigen::Vector3d(5, -4, 3);
}

// A crease: planes of voxels that have swapped places. Bone beside it stays where it is.
TEST(FoldRepair, ACreaseIsOpenedAndBoneStays) {
  const Mask body(ObliqueGrid({16, 16, 16}), 1);
  LabelMap bones(body.grid);
  for (int k = 0; k < 16; ++k) bones(4, 8, k) = 1;
  const WorkRegion region{Eigen::Vector3i::Zero(), body.grid};
  std::vector<Eigen::Vector3f> scan_mm;
  for (size_t v = 0; v < body.values.size(); ++v) {
    Eigen::Vector3d p = body.grid.Ijk(v).cast<double>();
    const double deep = std::exp(-0.05 * (p - Eigen::Vector3d(9, 8, 8)).squaredNorm());
    if (body.grid.Ijk(v).x() >= 8 && !bones.values[v]) p.x() -= 2.5 * deep;
    scan_mm.push_back(body.grid.ToMm(PointVox{p}).lps.cast<float>());
  }
  const std::vector<Eigen::Vector3f> before = scan_mm;
  const auto folded = [&] {
    int count = 0;
    for (size_t v = 0; v < scan_mm.size(); ++v)
      count += Determinant(scan_mm, region, body.grid, body.grid.Ijk(v)) <= 0;
    return count;
  };
  EXPECT_GT(folded(), 10);
  Unfold(bones, body, region, {}, scan_mm);
  EXPECT_EQ(folded(), 0);
  for (size_t v = 0; v < scan_mm.size(); ++v) {
    if (bones.values[v]) {
      EXPECT_EQ(scan_mm[v], before[v]);
    }
  }
}

// Two bones with one voxel of tissue in between, found `overlap` voxels inside one another.
struct Joint {
  Mask body{ObliqueGrid({18, 12, 12}), 1};
  LabelMap bones{body.grid};
  WorkRegion region{Eigen::Vector3i::Zero(), body.grid};
  std::vector<Eigen::Vector3f> scan_mm;

  explicit Joint(double overlap) {
    for (size_t v = 0; v < body.values.size(); ++v) {
      const Eigen::Vector3i p = body.grid.Ijk(v);
      const bool across = std::max(std::abs(p.y() - 6), std::abs(p.z() - 6)) <= 2;
      bones.values[v] = !across ? 0 : p.x() >= 5 && p.x() <= 8 ? 1 : p.x() >= 10 && p.x() <= 13 ? 2 : 0;
      Eigen::Vector3d to = p.cast<double>();
      if (p.x() > 9) to.x() -= 1 + overlap;
      scan_mm.push_back(body.grid.ToMm(PointVox{to}).lps.cast<float>());
    }
  }
  int Folded() const {
    int count = 0;
    for (size_t v = 0; v < scan_mm.size(); ++v)
      count += Determinant(scan_mm, region, body.grid, body.grid.Ijk(v)) <= 0;
    return count;
  }
};

TEST(FoldRepair, BonesInsideOneAnotherLeaveNoFold) {
  Joint joint(1.2);
  const std::vector<Eigen::Vector3f> before = joint.scan_mm;
  EXPECT_GT(joint.Folded(), 20);
  Unfold(joint.bones, joint.body, joint.region, {}, joint.scan_mm);
  EXPECT_EQ(joint.Folded(), 0);
  for (size_t v = 0; v < before.size(); ++v) {  // away from the contact bone is where it was
    const int x = joint.body.grid.Ijk(v).x();
    if (joint.bones.values[v] && (x == 5 || x == 13)) {
      EXPECT_EQ(joint.scan_mm[v], before[v]);
    }
  }
}

// A bone that is torn a hundred of its lengths away and turned round leaves folds that nothing opens.
// Relaxed on and on, tissue went where no number reaches, and the program ended.
TEST(FoldRepair, WhatIsTornPastMendingStaysInItsRoom) {
  Joint joint(1.2);
  const Eigen::Vector3f far_mm(900, -900, 900);
  for (size_t v = 0; v < joint.scan_mm.size(); ++v)
    if (joint.bones.values[v] == 2) joint.scan_mm[v] = far_mm - joint.scan_mm[v];
  Unfold(joint.bones, joint.body, joint.region, {}, joint.scan_mm);
  for (const Eigen::Vector3f& mm : joint.scan_mm) ASSERT_LT(mm.norm(), 4 * far_mm.norm());
}

TEST(FoldRepair, StopsWhenItIsToldTo) {
  for (const int questions : {0, 5, 40}) {
    Joint joint(1.2);
    int asked = 0;
    const Progress progress({}, [&] { return asked++ >= questions; });
    EXPECT_THROW(Unfold(joint.bones, joint.body, joint.region, progress, joint.scan_mm), Cancelled);
    EXPECT_EQ(asked, questions + 1);
  }
}

TEST(FoldRepair, AMapWithoutFoldsIsLeftAsItIs) {
  const Mask body(ObliqueGrid({8, 8, 8}), 1);
  const WorkRegion region{Eigen::Vector3i::Zero(), body.grid};
  std::vector<Eigen::Vector3f> scan_mm;
  for (size_t v = 0; v < body.values.size(); ++v)
    scan_mm.push_back(Rigid(body.grid.ToMm(PointVox{body.grid.Ijk(v).cast<double>()}).lps).cast<float>());
  const std::vector<Eigen::Vector3f> before = scan_mm;
  EXPECT_NEAR(Determinant(scan_mm, region, body.grid, {3, 4, 5}), 1, 1e-4);
  Unfold(LabelMap(body.grid), body, region, {}, scan_mm);
  EXPECT_EQ(scan_mm, before);
}

}  // namespace
}  // namespace kvx
