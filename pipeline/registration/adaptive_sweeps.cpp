// One launch per colour: its blocks have disjoint supports, so they are solved and moved at once, without
// races, and the result does not depend on their order.
#include "pipeline/registration/adaptive_sweeps.h"

#include <algorithm>
#include <numeric>
#include <set>

#include "kernels/block_kernels.h"
#include "pipeline/registration/block_information.h"
#include "pipeline/registration/block_lattice.h"
#include "pipeline/registration/block_solver.h"
#include "core/parallel.h"

namespace kvx {
namespace {

constexpr int kMaxSweeps = 8;  // alternately on the lattice and on the one shifted by half a block
constexpr double kLeastStepVoxels = 0.03;  // below this a step is not worth its resampling

class Sweeper {
 public:
  Sweeper(const BlockLevel& level, Backend& backend, std::span<const FieldVector> field)
      : lattice_(level),
        solver_(BlockSpline(), level),
        kernels_(backend, level, MakeBallBasis(BlockSpline())),
        information_(level),
        least_mm_(kLeastStepVoxels * level.grid.spacing_mm.minCoeff()) {
    kernels_.SetField(field);
  }

  // Returns how many blocks moved.
  int Sweep(int shifted) {
    kernels_.RefreshTemplateSlope();
    int moved = 0;
    for (const int colour : WorstFirst(shifted)) {
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
  // The colours by their worst awake block.
  std::vector<int> WorstFirst(int shifted) {
    std::vector<cl_int4> supports;
    std::vector<int> colours;
    for (const BlockLattice::Block& block : lattice_.blocks(shifted)) {
      if (!lattice_.Awake(block)) continue;
      supports.push_back(block.support);
      colours.push_back(block.colour);
    }
    const std::vector<double> mismatch = Mismatch(supports);
    std::vector<double> worst(kColours, -1.0);
    for (size_t b = 0; b < colours.size(); ++b) worst[colours[b]] = std::max(worst[colours[b]], mismatch[b]);
    std::vector<int> order(kColours);
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return worst[a] > worst[b]; });
    return order;
  }

  std::vector<double> Mismatch(const std::vector<cl_int4>& supports) {
    std::vector<double> out;
    if (information_.Applies()) {
      for (const BlockInformation::Value& value :
           information_.Of(kernels_, supports, BlockKernels::State::kField)) {
        out.push_back(1 - value.normalised);
      }
      return out;
    }
    const std::vector<float> sums = kernels_.Sums(supports);
    for (size_t b = 0; b < supports.size(); ++b) {
      out.push_back(solver_.DataEnergyPerWeight(std::span(sums).subspan(b * kSumChannels, kSumChannels)));
    }
    return out;
  }

  int Visit(const std::vector<BlockLattice::Block*>& blocks) {
    std::vector<cl_int4> supports;
    for (const auto* block : blocks) supports.push_back(block->support);
    kernels_.RefreshCurvature();
    const std::vector<float> equations = kernels_.Equations(supports);
    std::vector<BlockStep> steps(blocks.size());
    ParallelRanges(blocks.size(), [&](size_t begin, size_t end) {
      for (size_t b = begin; b < end; ++b)
        steps[b] = solver_.Solve(std::span(equations).subspan(b * kEquationValues, kEquationValues));
    });
    std::vector<float> displacements;
    for (const BlockStep& step : steps)
      displacements.insert(displacements.end(), step.displacement_mm.begin(), step.displacement_mm.end());
    const std::vector<float> trial = kernels_.TrialSums(supports, displacements);
    std::vector<BlockInformation::Value> informed, informs;  // before and after
    if (information_.Applies()) {
      informed = information_.Of(kernels_, supports, BlockKernels::State::kField);
      informs = information_.Of(kernels_, supports, BlockKernels::State::kTrial);
    }
    std::vector<cl_int> accepted(blocks.size());
    int moved = 0;
    for (size_t b = 0; b < blocks.size(); ++b) {
      const auto before = std::span(equations).subspan(b * kEquationValues + 480, kSumChannels);
      const auto after = std::span(trial).subspan(b * kSumChannels, kSumChannels);
      const double gain = information_.Applies() ? BlockInformation::GainNats(informed[b], informs[b])
                                                 : EnergyGain(before, after);
      accepted[b] = after[0] >= 0.5f * before[0] && Earns(steps[b], gain);
      moved += accepted[b];
      lattice_.Visited(*blocks[b], accepted[b]);
      if (accepted[b]) registered_.insert(blocks[b]);
    }
    kernels_.Accept(supports, accepted);
    return moved;
  }

  double EnergyGain(std::span<const float> before, std::span<const float> after) const {
    return before[0] * (solver_.DataEnergyPerWeight(before) - solver_.DataEnergyPerWeight(after));
  }

  // Noise alone gains half a unit of energy per free parameter; a step must gain twice that (Akaike).
  bool Earns(const BlockStep& step, double gain) const {
    return step.largest_mm >= least_mm_ && gain - step.bending_change > step.freedom;
  }

  BlockLattice lattice_;
  BlockSolver solver_;
  BlockKernels kernels_;
  BlockInformation information_;
  double least_mm_;
  std::set<const BlockLattice::Block*> registered_;
};

}  // namespace

int64_t RegisterLevel(const BlockLevel& level, Backend& backend, const Progress& progress,
                      std::vector<FieldVector>& field) {
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
