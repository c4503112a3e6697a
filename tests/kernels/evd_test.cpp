// The posing kernels against their plain-loop twins, on a small body of two bones with discontinuous weights.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "kernels/evd_pull.h"
#include "kernels/evd_reach.h"
#include "kernels/reference/evd.h"
#include "pipeline/posing/brick_body.h"
#include "tests/support/fixtures.h"
#include "tests/support/hinge_world.h"

namespace kvx {
namespace {
using namespace testing_support;

struct Posing {
  explicit Posing(double angle_rad, bool torn = false, bool loose = false)
      : pose(world.Bent(angle_rad)), to(world.body.grid) {
    if (loose) {  // tissue follows both bones by halves, and these touch
      for (size_t v = 0; v < world.weights.values.size(); ++v) {
        const PointMm x = world.body.grid.ToMm(PointVox{world.body.grid.Ijk(v).cast<double>()});
        const bool outer = world.along.dot(x.lps - world.hinge.lps) > 0, in_bone = world.DeepInside(x, 4);
        world.bones.labels.values[v] = !in_bone ? 0 : outer ? 2 : 1;
        world.weights.values[v] = in_bone ? VoxelWeights{{outer, !outer, 0, 0}, {1, 0, 0, 0}}
                                          : VoxelWeights{{0, 1, 0, 0}, {0.5f, 0.5f, 0, 0}};
      }
    }
    if (torn) {  // a jump of the weights across a cut through half of the bar, between bones that are no kin
      world.bones.bones[1].parent = kNoParent;
      world.bones.bones[0].parent = 2;
      world.bones.bones.push_back({.label = 3, .name = "none", .parent = kNoParent});
      for (size_t v = 0; v < world.weights.values.size(); ++v) {
        const Eigen::Vector3i n = world.body.grid.Ijk(v);
        if (n.y() > 15) world.weights.values[v] = {{uint8_t(n.z() > 24), 0, 0, 0}, {1, 0, 0, 0}};
      }
    }
    bulge = world.Bulge(1.5);
    bricked = BrickBody(world.Inputs({&bulge}));
    coefficients = Eigen::MatrixXf::Constant(2, 1, 0.7f);
    to.spacing_mm *= 1.1;
    to.direction = Eigen::AngleAxisd(0.2, Eigen::Vector3d(1, 1, 0.3).normalized()) * to.direction;
    truth = reference::EvdForward(bricked, world.body.grid, to, pose, coefficients);
    for (int brick = 0; brick < bricked.stored(); ++brick) every.push_back(brick);
    list = DeviceBuffer<int32_t>(SharedBackend(), every);
  }
  // As many voxels around the same middle, `times` finer.
  void Refine(double times) {
    const Eigen::Vector3d middle = 0.5 * (to.size.array() - 1).cast<double>();
    const PointMm centre = to.ToMm(PointVox{middle});
    to.spacing_mm /= times;
    to.origin.lps += centre.lps - to.ToMm(PointVox{middle}).lps;
    truth = reference::EvdForward(bricked, world.body.grid, to, pose, coefficients);
  }
  // A part of the voxels alone.
  void Crop(const Eigen::Vector3i& first, const Eigen::Vector3i& size) {
    to.origin = to.ToMm(PointVox{first.cast<double>()});
    to.size = size;
    truth = reference::EvdForward(bricked, world.body.grid, to, pose, coefficients);
  }
  // The twin's places on the device: both sides of a comparison then start from the same numbers.
  void Upload(PosedNodes& posed) {
    std::vector<float> places(truth.size() * 3);
    for (size_t n = 0; n < truth.size(); ++n) {
      truth[n] = truth[n].cast<float>().cast<double>();
      for (int a = 0; a < 3; ++a) places[n / 64 * 192 + size_t(a) * 64 + n % 64] = float(truth[n][a]);
    }
    posed.places.Upload(SharedBackend().queue(), places);
  }
  HingeWorld world;
  PoseVector pose;
  Grid to;
  DisplacementField bulge;
  BrickedBody bricked;
  Eigen::MatrixXf coefficients;
  reference::Places truth;
  std::vector<int32_t> every;
  DeviceBuffer<int32_t> list;
  BufferCounts counts;
};

TEST(EvdForward, IsWithinAThousandthOfAVoxelOfItsTwin) {
  Backend& backend = SharedBackend();
  for (const double angle : {0.4, 2.2, 2.6}) {  // linear, half way to the dual-quaternion guard, and there
    Posing p(angle);
    const DeviceBody device(backend, p.bricked);
    PosedNodes posed(backend, p.counts);
    EvdForward{backend}(backend.queue(), device, p.list.buffer(), device.stored,
                        ForwardPose(p.world.body.grid, p.to, p.pose, p.coefficients), posed);
    posed.places.Read(backend.queue(), p.truth.size() * 3, [&](std::span<const float> found) {
      for (size_t n = 0; n < p.truth.size(); ++n) {
        const float* at = &found[n / 64 * 192 + n % 64];
        ASSERT_LT((Eigen::Vector3d(at[0], at[64], at[128]) - p.truth[n]).norm(), 1e-3) << angle << " rad";
      }
    });
  }
}

TEST(EvdForward, BoundsThePosedBodyOfEveryBrick) {
  Backend& backend = SharedBackend();
  Posing p(0.7);
  const DeviceBody device(backend, p.bricked);
  PosedNodes posed(backend, p.counts);
  EvdForward{backend}(backend.queue(), device, p.list.buffer(), device.stored,
                      ForwardPose(p.world.body.grid, p.to, p.pose, p.coefficients), posed);
  posed.body_boxes.Read(backend.queue(), 2 * size_t(device.stored), [&](std::span<const cl_float4> boxes) {
    for (int brick = 0; brick < device.stored; ++brick) {
      Eigen::Vector3d lo = Eigen::Vector3d::Constant(INFINITY), hi = -lo;
      for (int n = 0; n < 64; ++n) {
        if (!((p.bricked.body[size_t(brick)] >> n) & 1)) continue;
        lo = lo.cwiseMin(p.truth[size_t(brick) * 64 + n]), hi = hi.cwiseMax(p.truth[size_t(brick) * 64 + n]);
      }
      for (int a = 0; a < 3; ++a) {
        if (std::isinf(lo[a])) {
          ASSERT_GT(boxes[2 * size_t(brick)].s[a], boxes[2 * size_t(brick) + 1].s[a]);
        } else {
          ASSERT_NEAR(boxes[2 * size_t(brick)].s[a], lo[a], 1e-3);
          ASSERT_NEAR(boxes[2 * size_t(brick) + 1].s[a], hi[a], 1e-3);
        }
      }
    }
  });
}

TEST(EvdReach, EqualsItsTwinAndLeavesOutNoBrickWhoseNodesMeetThePlane) {
  Backend& backend = SharedBackend();
  for (const double angle : {0.4, 2.0}) {
    Posing p(angle);
    Grid plane = p.to;
    plane.size.z() = 1;
    plane.origin = p.to.ToMm(PointVox{Eigen::Vector3d(0, 0, 30.3)});
    const reference::Places posed =
        reference::EvdForward(p.bricked, p.world.body.grid, plane, p.pose, p.coefficients);
    const DeviceBody device(backend, p.bricked);
    ReachingBricks found(backend, p.counts);
    const EvdReach reach(backend);
    reach.Bound(backend.queue(), device,
                ForwardPose(p.world.body.grid, p.world.body.grid, p.pose, p.coefficients), found);
    reach(backend.queue(), p.bricked, device, p.world.body.grid, plane, found);
    std::vector<uint8_t> reaches(size_t(p.bricked.cell_bricks), 0);
    for (const int32_t brick : found.host_cells) reaches[size_t(brick)] = 1;
    const auto twin = reference::EvdReach(p.bricked, p.world.body.grid, plane, p.pose, p.coefficients,
                                          EvdReach::Margin(p.world.body.grid, plane),
                                          EvdReach::CutMargin(p.world.body.grid, plane));
    size_t unlike = 0, left_out = 0;
    for (size_t brick = 0; brick < reaches.size(); ++brick) {
      unlike += reaches[brick] != twin[brick], left_out += !reaches[brick];
      Eigen::Vector3d lo = Eigen::Vector3d::Constant(INFINITY), hi = -lo;
      for (int n = 0; n < 125; ++n) {
        const Eigen::Vector3i node =
            p.bricked.FirstNode(int(brick)) + Eigen::Vector3i(n % 5, n / 5 % 5, n / 25);
        const Eigen::Vector3d& at =
            posed[size_t(p.bricked.BrickOf(node)) * 64 + size_t(BrickedBody::Slot(node))];
        lo = lo.cwiseMin(at), hi = hi.cwiseMax(at);
      }
      if ((lo.array() <= (plane.size.array() - 1).cast<double>()).all() && (hi.array() >= 0).all()) {
        ASSERT_TRUE(reaches[brick]) << "brick " << brick << " at " << angle;
      }
    }
    EXPECT_LE(unlike, 1u);
    EXPECT_GT(left_out, reaches.size() / 3);
  }
}

constexpr std::array<float, 4> kLevels{0.5f, 0.45f, 0.4f, 0.5f};  // of the labels

struct Pulled {
  std::vector<float> places, values;  // four and one per voxel
  std::vector<uint16_t> labels;
  int64_t folded;
};

Pulled PullOnDevice(Posing& p) {
  Backend& backend = SharedBackend();
  const DeviceBody device(backend, p.bricked);
  PosedNodes posed(backend, p.counts);
  p.Upload(posed);
  PosedCells cells(backend, p.counts);
  EvdCells{backend}(backend.queue(), device, p.list.buffer(), p.bricked.cell_bricks, posed, p.pose,
                    Eigen::Vector3d::Zero(), p.world.body.grid, p.to, cells);
  const EvdPull pull(backend);
  const DeviceBuffer<float> image(backend, std::span(p.world.scan.volume.values));
  const DeviceBuffer<float> values(backend, p.to.VoxelCount()), places(backend, 4 * p.to.VoxelCount());
  pull.Places(backend.queue(), device, p.list.buffer(), cells, p.to, places.buffer());
  pull.Intensities(backend.queue(), device, p.list.buffer(), cells, p.to, image, p.world.body.grid,
                   Sampling::kLinear, -50, values.buffer());
  const DeviceBuffer<uint16_t> template_labels(backend, std::span(p.world.bones.labels.values));
  const DeviceBuffer<float> levels(backend, std::span(kLevels));
  const DeviceBuffer<uint16_t> labels(backend, p.to.VoxelCount());
  pull.Labels(backend.queue(), device, p.list.buffer(), cells, p.to, template_labels, levels,
              p.world.body.grid, labels.buffer());
  return {places.Download(backend.queue()), values.Download(backend.queue()),
          labels.Download(backend.queue()), cells.folded};
}

// Returns how many voxels the twin mended.
size_t ExpectSameLandings(double angle_rad, bool torn, double finer = 1, bool loose = false) {
  Posing p(angle_rad, torn, loose);
  p.Refine(finer);
  const Pulled found = PullOnDevice(p);
  const reference::Cells cells = reference::EvdCells(p.bricked, p.truth, p.world.body.grid, p.to);
  const auto landings = reference::EvdPull(p.bricked, cells, p.pose, p.world.body.grid, p.to);
  const Volume twin = reference::EvdIntensities(landings, p.to, p.world.scan.volume, -50);
  const auto mending = reference::EvdMending(landings, p.to, p.world.body.grid);
  size_t claimed = 0, other_claim = 0, other_place = 0, other_value = 0, mended = 0, other_mended = 0;
  for (size_t v = 0; v < landings.size(); ++v) {
    const float* at = &found.places[4 * v];
    if (landings[v].claim != reference::kUnclaimed) ++claimed;
    other_claim += int(at[3]) != landings[v].claim;
    if (mending[v] != reference::Mending::kNone) {
      ++mended;
      other_mended += !(std::abs(found.values[v] - twin.values[v]) < 0.5);
      continue;
    }
    if (int(at[3]) != landings[v].claim || landings[v].claim == reference::kUnclaimed) continue;
    other_place += !((Eigen::Vector3d(at[0], at[1], at[2]) - landings[v].place).norm() < 0.02);
    other_value += !(std::abs(found.values[v] - twin.values[v]) < 0.5);
  }
  EXPECT_GT(claimed, 3000u);
  EXPECT_LE(other_claim, claimed / 200);  // on a face or a threshold, decided by rounding
  EXPECT_LE(other_place, claimed / 200);
  EXPECT_LE(other_value, claimed / 200);
  EXPECT_LE(other_mended, mended / 10);
  const double rounding = 0.02 * double(cells.folded) + 0.5;
  EXPECT_LE(double(found.folded), double(cells.folded) + rounding);
  if (finer == 1) {  // else some are out of the grid
    EXPECT_GE(double(found.folded), double(cells.folded) - rounding);
  }
  return mended;
}

// Bones that press on each other mend and decide the most.
TEST(EvdPull, LabelsAreThoseOfItsTwin) {
  for (const double angle : {0.1, 0.8, 2.4}) {
    Posing p(angle, false, angle < 0.5);
    const Pulled found = PullOnDevice(p);
    const reference::Cells cells = reference::EvdCells(p.bricked, p.truth, p.world.body.grid, p.to);
    const auto landings = reference::EvdPull(p.bricked, cells, p.pose, p.world.body.grid, p.to);
    const LabelMap twin =
        reference::EvdLabels(landings, p.to, p.world.bones.labels, {kLevels.begin(), kLevels.end()});
    size_t labelled = 0, other = 0;
    for (size_t v = 0; v < landings.size(); ++v)
      labelled += twin.values[v] != 0, other += found.labels[v] != twin.values[v];
    EXPECT_GT(labelled, 300u) << angle;
    EXPECT_LE(other, labelled / 200) << angle;
  }
}

TEST(EvdPull, LandsWhereItsTwinDoesOnASmoothBend) { ExpectSameLandings(0.8, false); }
TEST(EvdPull, LandsWhereItsTwinDoesWhereWeightsJump) { ExpectSameLandings(0.5, true); }
TEST(EvdPull, LandsWhereItsTwinDoesWhereTheBodyFolds) { EXPECT_GT(ExpectSameLandings(2.4, false), 0u); }

// Bones draw away from the tissue around them and from each other, and press on them.
TEST(EvdPull, LandsWhereItsTwinDoesBesideBonesThatMoveByThemselves) {
  for (const double angle : {0.1, 0.3}) ExpectSameLandings(angle, false, 1, true);
}

// Many voxels land in every unit cell, and many chunks of landings in every brick.
TEST(EvdPull, LandsWhereItsTwinDoesOnAFineGrid) { ExpectSameLandings(2.4, false, 3); }

// A map that is continuous and stays as it was around a place reaches all that it reached before, however it
// folds there.
TEST(EvdPull, LeavesNoGapAroundAFold) {
  Posing p(0.4);
  p.Refine(6);
  const auto inside = [](int claim) { return claim <= reference::kInnerBody; };
  const Pulled before = PullOnDevice(p);
  const Eigen::Vector3d middle = 0.5 * (p.to.size.array() - 1).cast<double>();
  const Eigen::Vector3i node =
      p.world.body.grid.ToVox(p.to.ToMm(PointVox{middle})).ijk.array().round().cast<int>();
  const auto place = [&](const Eigen::Vector3i& n) -> Eigen::Vector3d& {
    return p.truth[size_t(p.bricked.BrickOf(n)) * 64 + size_t(BrickedBody::Slot(n))];
  };
  place(node) +=
      0.6 * (place(node + Eigen::Vector3i::Ones()) - place(node));  // over the plane of three others
  const Pulled folded = PullOnDevice(p);
  const reference::Cells cells = reference::EvdCells(p.bricked, p.truth, p.world.body.grid, p.to);
  EXPECT_TRUE(std::ranges::any_of(cells.cells, [](const auto& c) { return c.tetrahedron >= 0; }));
  const auto twin = reference::EvdPull(p.bricked, cells, p.pose, p.world.body.grid, p.to);
  size_t reached = 0, gaps = 0, gaps_of_twin = 0;
  for (size_t v = 0; v < twin.size(); ++v) {
    if (!inside(int(before.places[4 * v + 3]))) continue;
    ++reached;
    gaps += int(folded.places[4 * v + 3]) == reference::kUnclaimed;
    gaps_of_twin += twin[v].claim == reference::kUnclaimed;
  }
  EXPECT_GT(reached, 10000u);
  EXPECT_EQ(gaps, 0u);
  EXPECT_EQ(gaps_of_twin, 0u);
}

TEST(EvdMending, FillsCracksThinnerThanAVoxelAndClearsSpecksButKeepsGaps) {
  Grid grid;
  grid.size = {9, 9, 9};
  std::vector<reference::Landing> landings(grid.VoxelCount());
  const auto at = [&](int i, int j, int k) -> int& { return landings[grid.Index(i, j, k)].claim; };
  for (int k = 1; k < 6; ++k)
    for (int j = 1; j < 8; ++j)
      for (int i = 1; i < 8; ++i) at(i, j, k) = reference::kInnerBody;
  at(2, 2, 3) = reference::kUnclaimed;                           // a hole
  for (int j = 1; j < 8; ++j) at(6, j, 3) = reference::kMargin;  // a crack along j
  for (int k = 1; k < 6; ++k)
    for (int j = 1; j < 8; ++j) at(4, j, k) = reference::kMargin;  // a gap between two parts
  at(3, 6, 4) = reference::kRim;                                   // skin caught between
  at(7, 7, 7) = reference::kRim;                                   // a speck
  at(7, 3, 8) = reference::kRim;                                   // more may lie beyond the grid
  const auto mending = reference::EvdMending(landings, grid, grid);
  const auto is = [&](int i, int j, int k) { return mending[grid.Index(i, j, k)]; };
  EXPECT_EQ(is(2, 2, 3), reference::Mending::kFill);
  EXPECT_EQ(is(6, 4, 3), reference::Mending::kFill);
  EXPECT_EQ(is(3, 6, 4), reference::Mending::kFill);
  EXPECT_EQ(is(4, 4, 3), reference::Mending::kNone);
  EXPECT_EQ(is(7, 7, 7), reference::Mending::kClear);
  EXPECT_EQ(is(7, 3, 8), reference::Mending::kNone);
  EXPECT_EQ(is(1, 1, 1), reference::Mending::kNone);
  Grid fine = grid;
  fine.spacing_mm /= 1.6;
  EXPECT_EQ(reference::EvdMending(landings, grid, fine)[grid.Index(7, 7, 7)], reference::Mending::kNone);
}

// Of five voxels a side, within the body.
Eigen::Vector3i FirstOfCubeInside(const Posing& p, const Pulled& shown) {
  for (size_t v = 0; v < p.to.VoxelCount(); ++v) {
    const Eigen::Vector3i first = p.to.Ijk(v);
    bool inside = p.to.Contains(Eigen::Vector3i(first.array() + 4));
    for (int n = 0; inside && n < 125; ++n) {
      const Eigen::Vector3i at = first + Eigen::Vector3i(n % 5, n / 5 % 5, n / 25);
      inside = int(shown.places[4 * p.to.Index(at.x(), at.y(), at.z()) + 3]) <= reference::kInnerBody;
    }
    if (inside) return first;
  }
  throw std::logic_error("the body is thinner than five voxels");
}

// What is asked for of a grid shows what the whole of it shows, one voxel alone as well.
TEST(EvdMending, APartOfAGridShowsWhatAllOfItShows) {
  Posing whole(0.4);
  const Pulled all = PullOnDevice(whole);
  const Eigen::Vector3i first = FirstOfCubeInside(whole, all);
  using Size = Eigen::Vector3i;
  for (const Size& size : {Size(1, 1, 1), Size(5, 1, 1), Size(1, 5, 1), Size(5, 5, 1), Size(5, 5, 5)}) {
    Posing part(0.4);
    part.Crop(first, size);
    const std::vector<float> some = PullOnDevice(part).values;
    for (size_t v = 0; v < some.size(); ++v) {
      const Eigen::Vector3i at = first + part.to.Ijk(v);
      EXPECT_NEAR(some[v], all.values[whole.to.Index(at.x(), at.y(), at.z())], 0.5)
          << size.transpose() << ", voxel " << v;
    }
  }
}

// The bar is a voxel or two thick on these: its voxels have no neighbours across it.
TEST(EvdMending, TakesNothingAwayFromACoarseGrid) {
  Posing coarse(0.8);
  coarse.Refine(1 / 12.0);
  const Pulled found = PullOnDevice(coarse);
  size_t bodies = 0;
  for (size_t v = 0; v < found.values.size(); ++v) {
    if (int(found.places[4 * v + 3]) > reference::kRim) continue;
    ++bodies;
    EXPECT_NE(found.values[v], -50);
  }
  EXPECT_GT(bodies, 0u);
}

TEST(EvdCells, MeetsEveryKindOfCell) {
  std::array<size_t, 3> met{};  // bricks, unit cells, tetrahedra
  for (const double angle : {0.8, 2.4}) {
    Posing p(angle);
    for (const auto& c : reference::EvdCells(p.bricked, p.truth, p.world.body.grid, p.to).cells)
      ++met[c.tetrahedron >= 0 ? 2 : c.edge < 4 ? 1 : 0];
  }
  for (const size_t count : met) EXPECT_GT(count, 0u);
}

}  // namespace
}  // namespace kvx
