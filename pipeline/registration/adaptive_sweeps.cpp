// One launch per colour: its blocks have disjoint supports, so they are solved and moved at once, without races, and the
// result does not depend on their order.
#include "pipeline/registration/adaptive_sweeps.h"

#include <set>

#include "kernels/block_kernels.h"
#include "pipeline/registration/block_lattice.h"
#include "pipeline/registration/block_solver.h"
#include "core/parallel.h"

namespace kvx {
namespace {

constexpr int kMaxSweeps = 8;          // alternately on the lattice and on the one shifted by half a block
constexpr double kLeastStepVoxels = 0.03;  // below this a step is not worth its resampling

class Sweeper {
 public:
  Sweeper(const BlockLevel& level, Backend& backend, std::span<const FieldVector> field)
      : lattice_(level), solver_(BlockSpline(), level), kernels_(backend, level, MakeBallBasis(BlockSpline())),
        least_mm_(kLeastStepVoxels * level.grid.spacing_mm.minCoeff()) {
    kernels_.SetField(field);
  }

  // Returns how many blocks moved.
  int Sweep(int shifted) {
    kernels_.RefreshTemplateSlope();
    int moved = 0;
    for (int colour = 0; colour < kColours; ++colour) {
      std::vector<BlockLattice::Block*> awake;
      for (BlockLattice::Block& block : lattice_.blocks(shifted)) {
        if (block.colour == colour && lattice_.Awake(block)) awake.push_back(&block);
      }
      if (!awake.empty()) moved += Visit(awake);
    }
    return moved;
  }

  std::vector<FieldVector> Field() const { return kernels_.Field(); }
  int64_t registered() const { return int64_t(registered_.size()); }

 private:
  int Visit(const std::vector<BlockLattice::Block*>& blocks) {
    std::vector<cl_int4> supports;
    for (const auto* block : blocks) supports.push_back(block->support);
    kernels_.RefreshCurvature();
    const std::vector<float> equations = kernels_.Equations(supports);
    std::vector<BlockStep> steps(blocks.size());
    ParallelRanges(blocks.size(), [&](size_t begin, size_t end) {
      for (size_t b = begin; b < end; ++b) steps[b] = solver_.Solve(std::span(equations).subspan(b * kEquationValues, kEquationValues));
    });
    std::vector<float> displacements;
    for (const BlockStep& step : steps) displacements.insert(displacements.end(), step.displacement_mm.begin(), step.displacement_mm.end());
    const std::vector<float> trial = kernels_.TrialSums(supports, displacements);
    std::vector<cl_int> accepted(blocks.size());
    int moved = 0;
    for (size_t b = 0; b < blocks.size(); ++b) {
      const auto before = std::span(equations).subspan(b * kEquationValues + 480, kSumChannels);
      const auto after = std::span(trial).subspan(b * kSumChannels, kSumChannels);
      accepted[b] = Earns(steps[b], before, after);
      moved += accepted[b];
      lattice_.Visited(*blocks[b], accepted[b]);
      if (accepted[b]) registered_.insert(blocks[b]);
    }
    kernels_.Accept(supports, accepted);
    return moved;
  }

  // Noise alone gains half a unit of energy per free parameter; a step must gain twice that (Akaike).
  bool Earns(const BlockStep& step, std::span<const float> before, std::span<const float> after) const {
    if (step.largest_mm < least_mm_ || after[0] < 0.5f * before[0]) return false;
    const double gain = before[0] * (solver_.DataEnergyPerWeight(before) - solver_.DataEnergyPerWeight(after));
    return gain - step.bending_change > step.freedom;
  }

  BlockLattice lattice_;
  BlockSolver solver_;
  BlockKernels kernels_;
  double least_mm_;
  std::set<const BlockLattice::Block*> registered_;
};

}  // namespace

int64_t RegisterLevel(const BlockLevel& level, Backend& backend, const Progress& progress, std::vector<FieldVector>& field) {
  Sweeper sweeper(level, backend, field);
  int quiet = 0;
  for (int sweep = 0; sweep < kMaxSweeps && quiet < 2; ++sweep) {
    progress.Report("register", double(sweep) / kMaxSweeps);
    const int moved = sweeper.Sweep(sweep % 2);
    quiet = moved == 0 ? quiet + 1 : 0;
  }
  field = sweeper.Field();
  return sweeper.registered();
}

}  // namespace kvx
