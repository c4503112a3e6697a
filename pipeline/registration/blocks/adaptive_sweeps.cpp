// One launch per colour: its blocks have disjoint supports, so they are solved and moved at once, without
// races, and the result does not depend on their order. Within a sweep the images are taken as linear; then
// the sweep is judged by what the scan really shows, block by block.
#include "pipeline/registration/blocks/adaptive_sweeps.h"

#include <algorithm>
#include <numeric>
#include <set>
#include <unordered_map>
#include <utility>

#include "core/host/parallel.h"
#include "core/voxels/gaussian_blur.h"
#include "kernels/block_kernels.h"
#include "pipeline/registration/blocks/block_information.h"
#include "pipeline/registration/blocks/block_scale.h"
#include "pipeline/registration/blocks/information_targets.h"
#include "pipeline/registration/blocks/wide_level.h"

namespace kvx {
namespace {

constexpr double kLeastStepVoxels = 0.03;  // below this a step is not worth its resampling
constexpr int kHalvings = 1;  // of steps that turn out to make things worse; then they are dropped

constexpr size_t kVariancesBatch = 512;  // blocks whose equations are held at once: 1 MiB

// Standard deviation of what counts as about a cell: of a wave of a block's width it leaves a sixteenth.
constexpr double kAboutCells = 1.5;

// The cells of a block itself, counted from its support's first.
struct Middle {
  std::vector<Eigen::Vector3i> cells;
  std::vector<std::array<float, kControlPoints>> basis;

  explicit Middle(const BallBasis& ball) {
    for (size_t c = 0; c < ball.cells.size(); ++c) {
      const Eigen::Vector3i p(ball.cells[c].s[0], ball.cells[c].s[1], ball.cells[c].s[2]);
      if ((p.array() < kBlockVoxels / 2).any() || (p.array() >= kBlockVoxels).any()) continue;
      cells.push_back(p);
      basis.push_back(ball.cell_basis[c]);
    }
  }
};

class Sweeper {
 public:
  Sweeper(const BlockLevel& level, Backend& backend, std::vector<FieldVector> field)
      : level_(level),
        wide_level_(WideLevel(level)),
        own_(BlockWidth::kOwn, level),
        wide_(BlockWidth::kWide, wide_level_),
        kernels_(backend, level, MakeBallBasis(BlockSpline()), std::move(field)),
        middle_(MakeBallBasis(BlockSpline())),
        information_(level),
        targets_(level),
        least_mm_(kLeastStepVoxels * level.grid.spacing_mm.minCoeff()) {}

  // Returns how many blocks moved. `with_wide`: blocks twice as wide take their turn first.
  int Sweep(int shifted, bool with_wide) {
    if (targets_.Apply()) {
      const GreyTargets targets = targets_.Of(kernels_.Seen());
      kernels_.SetTargets(targets.greys, targets.weights);
    }
    kernels_.Linearise();
    taken_.clear();
    shown_before_.clear();
    if (with_wide) {
      kernels_.Restrict();
      VisitAll(wide_, shifted);
      kernels_.Prolong();
    }
    VisitAll(own_, shifted);
    if (taken_.empty()) return 0;
    Judge();
    kernels_.Accept();
    for (const Taken& taken : taken_) registered_.insert(taken.block);
    return int(taken_.size());
  }

  // The last thing to ask for.
  std::vector<FieldVector> TakeField() { return kernels_.TakeField(); }
  // Per cell, the mean of the two blocks whose middle it lies in, and of those about: whether a cell lies
  // amid its control points or beside one is of the lattice's making.
  std::vector<float> VariancesMm2() {
    kernels_.Linearise();
    Volume sum(Coarsened(level_.grid, 2)), count(sum.grid);
    for (const int shifted : {0, 1}) {
      const auto& blocks = own_.lattice.blocks(shifted);
      for (size_t first = 0; first < blocks.size(); first += kVariancesBatch)
        AddVariances(std::span(blocks).subspan(first, std::min(kVariancesBatch, blocks.size() - first)), sum,
                     count);
    }
    const std::vector<float> own_count = count.values;
    for (Volume* volume : {&sum, &count}) GaussianBlur(*volume, Eigen::Vector3d::Constant(kAboutCells));
    for (size_t c = 0; c < own_count.size(); ++c)
      sum.values[c] = own_count[c] > 0 ? sum.values[c] / count.values[c] : kNotKnown;
    return std::move(sum.values);
  }

  int64_t registered() const { return int64_t(registered_.size()); }

 private:
  struct Taken {
    const BlockScale* scale;
    const BlockLattice::Block* block;
    std::array<float, 24> step_mm;
  };
  // How a block's images agree.
  struct Shown {
    float weight = 0;
    double energy = 0;                    // per weight; where information does not apply
    BlockInformation::Value information;  // where it does
  };

  // Blocks of one lattice: no cell is in the middle of two.
  void AddVariances(std::span<const BlockLattice::Block> blocks, Volume& sum, Volume& count) {
    std::vector<cl_int4> supports;
    for (const auto& block : blocks) supports.push_back(block.support);
    const std::vector<float> equations = kernels_.Equations(supports);
    const Grid& cells = sum.grid;
    ParallelEach(blocks.size(), [&](size_t b) {
      const auto own = std::span(equations).subspan(b * kEquationValues, kEquationValues);
      const std::vector<float> variances =
          own_.solver.VariancesMm2(own, own_.Firmness(blocks[b]), middle_.basis);
      for (size_t n = 0; n < variances.size(); ++n) {
        const Eigen::Vector3i p =
            Eigen::Map<const Eigen::Vector3i>(blocks[b].support.s) / 2 + middle_.cells[n];
        if (!cells.Contains(p)) continue;
        const size_t c = cells.Index(p.x(), p.y(), p.z());
        sum.values[c] += variances[n], count.values[c] += 1;
      }
    });
  }

  void VisitAll(BlockScale& scale, int shifted) {
    for (const int colour : WorstFirst(scale, shifted)) {
      std::vector<BlockLattice::Block*> awake;
      for (BlockLattice::Block& block : scale.lattice.blocks(shifted)) {
        if (block.colour == colour && scale.Awake(block)) awake.push_back(&block);
      }
      if (!awake.empty()) Visit(scale, awake);
    }
  }

  // The colours by their worst awake block.
  std::vector<int> WorstFirst(BlockScale& scale, int shifted) {
    std::vector<const BlockLattice::Block*> awake;
    for (const BlockLattice::Block& block : scale.lattice.blocks(shifted))
      if (scale.Awake(block)) awake.push_back(&block);
    LookBefore(scale, awake);
    std::vector<double> worst(kColours, -1.0);
    for (const auto* block : awake)
      worst[block->colour] = std::max(worst[block->colour], Mismatch(scale, shown_before_.at(block)));
    std::vector<int> order(kColours);
    std::iota(order.begin(), order.end(), 0);
    std::stable_sort(order.begin(), order.end(), [&](int a, int b) { return worst[a] > worst[b]; });
    return order;
  }

  // Of those that have not been looked at in this sweep.
  void LookBefore(const BlockScale& scale, std::vector<const BlockLattice::Block*> blocks) {
    std::erase_if(blocks, [&](const auto* block) { return shown_before_.contains(block); });
    const std::vector<Shown> shown = ShownBy(scale, blocks, BlockKernels::State::kField);
    for (size_t b = 0; b < blocks.size(); ++b) shown_before_.emplace(blocks[b], shown[b]);
  }

  bool ByInformation(const BlockScale& scale) const {
    return scale.width == BlockWidth::kOwn && information_.Applies();
  }

  std::vector<Shown> ShownBy(const BlockScale& scale, std::span<const BlockLattice::Block* const> blocks,
                             BlockKernels::State state) {
    std::vector<cl_int4> supports;
    for (const auto* block : blocks) supports.push_back(block->support);
    const std::vector<float> sums = kernels_.Sums(supports, state, scale.width);
    std::vector<BlockInformation::Value> information;
    if (ByInformation(scale)) information = information_.Of(kernels_, supports, state);
    std::vector<Shown> out(blocks.size());
    for (size_t b = 0; b < out.size(); ++b) {
      const auto own = std::span(sums).subspan(b * kSumChannels, kSumChannels);
      out[b].weight = own[0];
      if (ByInformation(scale))
        out[b].information = information[b];
      else
        out[b].energy = scale.solver.DataEnergyPerWeight(own);
    }
    return out;
  }

  double Mismatch(const BlockScale& scale, const Shown& shown) const {
    return ByInformation(scale) ? 1 - shown.information.normalised : shown.energy;
  }

  bool IsWorse(const BlockScale& scale, const Shown& before, const Shown& after) const {
    const double gain = ByInformation(scale)
                            ? BlockInformation::GainNats(before.information, after.information)
                            : before.energy - after.energy;
    return after.weight < 0.5f * before.weight || gain <= 0;
  }

  void Visit(BlockScale& scale, const std::vector<BlockLattice::Block*>& blocks) {
    std::vector<cl_int4> supports;
    for (const auto* block : blocks) supports.push_back(block->support);
    const std::vector<float> equations = kernels_.Equations(supports, scale.width);
    std::vector<BlockStep> steps(blocks.size());
    ParallelEach(blocks.size(), [&](size_t b) {
      steps[b] = scale.solver.Solve(std::span(equations).subspan(b * kEquationValues, kEquationValues),
                                    scale.Firmness(*blocks[b]));
    });
    const size_t first = taken_.size();
    for (size_t b = 0; b < blocks.size(); ++b) {
      const bool earns = Earns(steps[b]);
      scale.lattice.Visited(*blocks[b], earns);
      if (!earns) continue;
      taken_.push_back({&scale, blocks[b], steps[b].displacement_mm});
      if (scale.width == BlockWidth::kWide) WakeOwn(*blocks[b]);
    }
    Add(scale, std::span(taken_).subspan(first), 1);
  }

  // Those that a wide block's step reaches.
  void WakeOwn(const BlockLattice::Block& wide) {
    own_.lattice.Changed(2 * Eigen::Map<const Eigen::Vector3i>(wide.support.s), 2 * kSupportVoxels);
  }

  // The prior alone decides how far a step goes:
  // asking for more than its gain left half of the error in place.
  bool Earns(const BlockStep& step) const {
    return step.largest_mm >= least_mm_ && step.data_gain > step.bending_change;
  }

  // Blocks of one colour.
  void Add(const BlockScale& scale, std::span<const Taken> blocks, float factor) {
    std::vector<cl_int4> supports;
    std::vector<float> steps;
    for (const Taken& taken : blocks) {
      supports.push_back(taken.block->support);
      for (const float f : taken.step_mm) steps.push_back(factor * f);
    }
    kernels_.AddSteps(supports, steps, scale.width);
  }

  // Tries the sweep; steps of blocks that got worse are halved, and then dropped.
  void Judge() {
    std::vector<const Taken*> suspects;
    for (const Taken& taken : taken_) suspects.push_back(&taken);
    for (const BlockScale* scale : {&wide_, &own_}) LookBefore(*scale, BlocksOf(Of(*scale, suspects)));
    float share = 1;  // of a step that has been suspect every time
    for (int round = 0; round <= kHalvings; ++round) {
      kernels_.Try();
      suspects = Worse(suspects);
      if (suspects.empty()) return;
      const float next = round < kHalvings ? 0.5f * share : 0.0f;
      Reduce(suspects, next - share);
      share = next;
    }
    Drop(BlocksOf(suspects));
  }

  // Adds so many times the steps of the suspects.
  void Reduce(const std::vector<const Taken*>& suspects, float by) {
    const std::vector<const Taken*> wide = Of(wide_, suspects);
    if (!wide.empty()) {
      kernels_.Restrict();
      Reduce(wide_, wide, by);
      kernels_.Prolong();
    }
    Reduce(own_, Of(own_, suspects), by);
  }

  void Reduce(const BlockScale& scale, const std::vector<const Taken*>& suspects, float by) {
    for (int colour = 0; colour < kColours; ++colour) {
      std::vector<Taken> reduced;
      for (const Taken* suspect : suspects)
        if (suspect->block->colour == colour) reduced.push_back(*suspect);
      Add(scale, reduced, by);
    }
  }

  // From what the sweep has taken; their steps are gone already.
  void Drop(const std::vector<const BlockLattice::Block*>& blocks) {
    const std::set<const BlockLattice::Block*> dropped(blocks.begin(), blocks.end());
    std::erase_if(taken_, [&](const Taken& taken) { return dropped.contains(taken.block); });
  }

  static std::vector<const Taken*> Of(const BlockScale& scale, std::span<const Taken* const> taken) {
    std::vector<const Taken*> out;
    for (const Taken* one : taken)
      if (one->scale == &scale) out.push_back(one);
    return out;
  }

  static std::vector<const BlockLattice::Block*> BlocksOf(std::span<const Taken* const> taken) {
    std::vector<const BlockLattice::Block*> out;
    for (const Taken* one : taken) out.push_back(one->block);
    return out;
  }

  // Those whose images agree less under the trial than under the field.
  std::vector<const Taken*> Worse(const std::vector<const Taken*>& suspects) {
    std::vector<const Taken*> out;
    for (const BlockScale* scale : {&wide_, &own_}) {
      const std::vector<const Taken*> own = Of(*scale, suspects);
      const std::vector<Shown> after = ShownBy(*scale, BlocksOf(own), BlockKernels::State::kTrial);
      for (size_t n = 0; n < own.size(); ++n)
        if (IsWorse(*scale, shown_before_.at(own[n]->block), after[n])) out.push_back(own[n]);
    }
    return out;
  }

  const BlockLevel& level_;
  const BlockLevel wide_level_;
  BlockScale own_, wide_;
  BlockKernels kernels_;
  Middle middle_;
  BlockInformation information_;
  InformationTargets targets_;
  double least_mm_;
  std::vector<Taken> taken_;  // of the sweep under way, colour by colour
  std::unordered_map<const BlockLattice::Block*, Shown> shown_before_;  // that sweep
  std::set<const BlockLattice::Block*> registered_;
};

}  // namespace

LevelOutcome RegisterLevel(const BlockLevel& level, Backend& backend, const Progress& progress,
                           const SweepCounts& sweeps, bool with_variances, std::vector<FieldVector>& field) {
  Sweeper sweeper(level, backend, std::exchange(field, {}));
  int quiet = 0;
  for (int sweep = 0; sweep < sweeps.most && quiet < 2; ++sweep) {
    progress.Report("register", double(sweep) / sweeps.most);
    const int moved = sweeper.Sweep(sweep % 2, sweep < sweeps.wide);
    quiet = moved == 0 ? quiet + 1 : 0;
  }
  LevelOutcome outcome{sweeper.registered(), {}};
  if (with_variances) outcome.variances_mm2 = sweeper.VariancesMm2();
  field = sweeper.TakeField();
  return outcome;
}

}  // namespace kvx
