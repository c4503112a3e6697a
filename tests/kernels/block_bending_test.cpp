// The force of the bending energy in a block's equations: the slope of that energy, and that of a wave on
// paper.
#include <gtest/gtest.h>

#include <numeric>

#include "core/voxels/voxel_box.h"
#include "tests/support/block_world.h"

namespace kvx {
namespace {
using namespace testing_support;
using Eigen::Vector3d, Eigen::Vector3i;

constexpr size_t kStepValues = 3 * kControlPoints;
constexpr size_t kForce = 384 + 3 * kStepValues;  // see block_equations.cl

// Per cell: the field's mean where the level is worked on, and 0 elsewhere.
std::vector<Vector3d> CellFields(const BlockWorld& world) {
  const Grid& grid = world.level.grid;
  const Grid cells = Coarsened(grid, 2);
  std::vector<Vector3d> out(cells.VoxelCount(), Vector3d::Zero());
  for (const cl_int c : world.level.active) {
    const Vector3i first = 2 * cells.Ijk(size_t(c));
    ForEachVoxel(VoxelBox{first, first + Vector3i::Constant(2)}, [&](const Vector3i& p) {
      out[size_t(c)] += world.field[grid.Index(p.x(), p.y(), p.z())].head<3>().cast<double>() / 8;
    });
  }
  return out;
}

// Half the strength times the integral of the squared laplacian, by cells: each as stiff as the level says,
// those at the border not at all. `steps`: as the cells have taken them.
double BendingEnergy(const BlockWorld& world, const reference::CellSteps& steps) {
  const BlockLevel& level = world.level;
  const Grid cells = Coarsened(level.grid, 2);
  const std::vector<float> mobility = CellMeans(level.grid, level.mobility);
  std::vector<Vector3d> field = CellFields(world);
  for (size_t c = 0; c < field.size(); ++c) field[c] += double(mobility[c]) * steps[c];
  const auto at = [&](const Vector3i& p) { return field[cells.Index(p.x(), p.y(), p.z())]; };
  double sum = 0;
  for (const cl_int c : level.active) {
    const Vector3i p = cells.Ijk(size_t(c));
    if ((p.array() == 0).any() || (p.array() == cells.size.array() - 1).any()) continue;
    Vector3d laplacian = Vector3d::Zero();
    for (int a = 0; a < 3; ++a) {
      const Vector3i next = Vector3i::Unit(a);
      laplacian += (at(p - next) - 2 * at(p) + at(p + next)) / std::pow(cells.spacing_mm[a], 2);
    }
    sum += double(level.stiffness[size_t(c)]) * laplacian.squaredNorm();
  }
  return 0.5 * level.bending * cells.spacing_mm.prod() * sum;
}

// All forces stand for cells that are not at the border.
const Vector3i kInside(8, 4, 4);
std::vector<cl_int4> InsideBlock() { return {{{kInside.x(), kInside.y(), kInside.z(), 0}}}; }

// The level ends in the block's ball, and stiffness and mobility are anything. The energy is quadratic, so
// that central differences are exact.
TEST(BlockKernelsBending, TheForceIsTheSlopeOfTheEnergy) {
  BlockWorld world = MakeBlockWorld();
  const Grid cells = Coarsened(world.level.grid, 2);
  for (auto* list : {&world.level.active, &world.level.visible})
    std::erase_if(*list, [&](cl_int c) { return cells.Ijk(size_t(c)).x() > 12; });
  BlockKernels kernels(SharedBackend(), world.level, world.ball, world.field);
  kernels.Linearise();
  reference::CellSteps taken = NoSteps(world);
  for (const bool moved : {false, true}) {
    if (moved) {
      std::vector<float> step_mm(kStepValues);
      for (size_t n = 0; n < kStepValues; ++n) step_mm[n] = 0.8f * float(std::sin(1.0 + double(n)));
      kernels.AddSteps(InsideBlock(), step_mm);
      reference::AddStep(world.level, world.ball, kInside, step_mm, taken);
    }
    const std::vector<float> equations = kernels.Equations(InsideBlock());
    std::vector<double> quotients;
    double largest = 0;
    for (size_t n = 0; n < kStepValues; ++n) {
      std::vector<float> step_mm(kStepValues, 0.0f);
      reference::CellSteps up = taken, down = taken;
      step_mm[n] = 1;
      reference::AddStep(world.level, world.ball, kInside, step_mm, up);
      step_mm[n] = -1;
      reference::AddStep(world.level, world.ball, kInside, step_mm, down);
      quotients.push_back((BendingEnergy(world, up) - BendingEnergy(world, down)) / 2);
      largest = std::max(largest, std::abs(quotients.back()));
    }
    EXPECT_GT(largest, 0.1);
    for (size_t n = 0; n < kStepValues; ++n)
      EXPECT_NEAR(equations[kForce + n], quotients[n], 1e-4 * largest) << n << ", " << moved;
  }
}

// Of a wave A sin(k.x) the energy's slope in every cell is strength, volume and k^4 times the wave, where
// cells of width h see 2 (1 - cos kh) / h^2 for k^2 along each axis, and cos(kh/4) of the wave.
TEST(BlockKernelsBending, AWaveIsHeldBackByTheFourthPowerOfItsNumber) {
  BlockWorld world = MakeBlockWorld({48, 48, 48});
  BlockLevel& level = world.level;
  const size_t voxels = level.grid.VoxelCount();
  level.mobility.assign(voxels, 1.0f), level.stiffness.assign(voxels / 8, 1.0f);
  level.active.resize(voxels / 8);
  std::iota(level.active.begin(), level.active.end(), 0);
  const Vector3d per_voxel(0.21, -0.17, 0.26), amplitude_mm(1.5, -2, 0.7);
  for (size_t v = 0; v < voxels; ++v) {
    const double phase = per_voxel.dot(level.grid.Ijk(v).cast<double>());
    world.field[v].head<3>() = (std::sin(phase) * amplitude_mm).cast<float>();
  }
  BlockKernels kernels(SharedBackend(), level, world.ball, world.field);
  kernels.Linearise();
  const std::vector<cl_int4> block = {{{12, 12, 12, 0}}};
  const std::vector<float> equations = kernels.Equations(block);
  const Vector3d cell_mm = 2 * level.grid.spacing_mm;
  double squared = 0, seen = 1;
  for (int a = 0; a < 3; ++a) {
    squared += 2 * (1 - std::cos(2 * per_voxel[a])) / std::pow(cell_mm[a], 2);
    seen *= std::cos(0.5 * per_voxel[a]);
  }
  const double size = level.bending * cell_mm.prod() * squared * squared * seen;
  for (size_t a = 0; a < kControlPoints; ++a) {
    double wave = 0, scale = 0;
    for (size_t c = 0; c < world.ball.cells.size(); ++c) {
      const Vector3i first = ToVector(block[0]) + 2 * ToVector(world.ball.cells[c]);
      const double phi = double(world.ball.cell_basis[c][a]);
      wave += phi * std::sin(per_voxel.dot(first.cast<double>() + Vector3d::Constant(0.5)));
      scale += std::abs(phi);
    }
    for (size_t axis = 0; axis < 3; ++axis) {
      const double force = size * amplitude_mm[Eigen::Index(axis)];
      EXPECT_NEAR(equations[kForce + 8 * axis + a], force * wave, 1e-4 * std::abs(force) * scale) << a;
    }
  }
}

}  // namespace
}  // namespace kvx
