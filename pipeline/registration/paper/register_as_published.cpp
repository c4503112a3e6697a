// Lines 1 to 11 of Algorithm 1, and the loop over resolutions around them.
#include "pipeline/registration/paper/register_as_published.h"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "core/host/parallel.h"
#include "pipeline/registration/paper/block_optimiser.h"
#include "pipeline/registration/paper/forecast.h"

namespace kvx {
namespace {

constexpr double kToleranceOfBase = 1.5;  // "1.5 x base MI" ...
constexpr double kToleranceRms = 18;      // ... "= 18 SSD" (paper, section 6.1)
constexpr double kLeastShare =
    0.05;                  // of a block's voxels that count: noise in air alone has the least MI of all
constexpr int kReach = 2;  // blocks whose B* a deformation of a block can change

struct Block {
  BlockIndex index;
  double mismatch = 0;
  bool visited = false;
};

std::vector<Block> BlocksOf(const PaperLevel& level) {
  const Eigen::Vector3i count = (level.counts.grid.size.array() + kBlockVoxels - 1) / kBlockVoxels;
  constexpr double kFull = kBlockVoxels * kBlockVoxels * kBlockVoxels;
  std::vector<Block> out;
  for (int n = 0; n < count.prod(); ++n) {
    const BlockIndex index(n % count.x(), n / count.x() % count.y(), n / (count.x() * count.y()));
    if (double(CountingVoxels(level, index, BlockPart::kBlock).size()) >= kLeastShare * kFull) {
      out.push_back({index});
    }
  }
  return out;
}

double MismatchOver(const PaperLevel& level, const Volume& deformed, std::span<const size_t> voxels) {
  std::vector<float> target, source;
  for (const size_t v : voxels)
    target.push_back(level.target.values[v]), source.push_back(deformed.values[v]);
  return Mismatch(level.by_information(), target, source);
}

// A block of 8 x 8 x 8 samples fills no histogram, so MI is taken over B*.
double MismatchOf(const PaperLevel& level, const Volume& deformed, const BlockIndex& block) {
  const BlockPart part = level.by_information() ? BlockPart::kWithNeighbours : BlockPart::kBlock;
  return MismatchOver(level, deformed, CountingVoxels(level, block, part));
}

// A block is registered while its mismatch is above this.
double ToleranceOf(const PaperLevel& level, const Volume& deformed) {
  if (!level.by_information()) return kToleranceRms;
  std::vector<size_t> all;
  for (size_t v = 0; v < level.counts.values.size(); ++v) {
    if (level.counts.values[v]) all.push_back(v);
  }
  return 1 - kToleranceOfBase * (1 - MismatchOver(level, deformed, all));
}

// What has been done, what is to be expected, and when to stop.
class Pace {
 public:
  using Clock = std::chrono::steady_clock;
  Pace(const PaperOptions& options, size_t levels, const Progress& progress)
      : options_(options), progress_(progress), levels_(levels, {.cost = 0}) {}

  bool Spent() const {
    return (options_.max_blocks > 0 && done_ >= options_.max_blocks) ||
           (options_.max_seconds > 0 && Seconds() >= options_.max_seconds);
  }
  // Before a level: what a level will take, as far as it can be seen now. Its cost is that of the first time:
  // a machine that was busier later would make later levels look dearer.
  template <class Cost>
  void Expect(size_t level, double blocks, const Cost& cost) {
    levels_[level].left = blocks;
    if (levels_[level].cost == 0) levels_[level].cost = cost();
    told_ = Seconds();
  }
  // A block of the level is done, and `left` of it wait.
  void Count(size_t level, double left) {
    const double now = Seconds();
    levels_[level].blocks += 1, levels_[level].seconds += now - told_, levels_[level].left = left;
    told_ = now, ++done_;
  }
  void End(size_t level) { levels_[level].left = 0; }
  void Report(int number) const {
    const PaperForecast forecast = ForecastOf(options_, levels_);
    progress_.Report("register: block level " + std::to_string(number) + ", " + forecast.text,
                     forecast.fraction);
  }

 private:
  double Seconds() const { return std::chrono::duration<double>(Clock::now() - start_).count(); }

  const PaperOptions& options_;
  const Progress& progress_;
  Clock::time_point start_ = Clock::now();
  std::vector<PaperPace> levels_;
  double told_ = 0;  // when what was done so far had been counted
  int64_t done_ = 0;
};

class LevelRun {
 public:
  LevelRun(const PaperLevel& level, uint64_t seed, VoxelShifts& shifts)
      : level_(level),
        seed_(seed),
        shifts_(shifts),
        deformed_(DeformedSource(level, shifts)),
        blocks_(BlocksOf(level)),
        tolerance_(ToleranceOf(level, deformed_)) {
    Measure([](const Block&) { return true; });
  }

  size_t Waiting() const {
    return size_t(std::ranges::count_if(blocks_, [&](const Block& b) { return Waits(b); }));
  }

  // Lines 4 to 11 once; false when no block is left.
  bool Step() {
    Block* worst = Worst();
    if (!worst) return false;
    worst->visited = true;
    const BlockWindow window(level_, deformed_, worst->index);
    const BlockOptimum optimum = OptimiseBlock(window, SeedOf(worst->index));
    if (optimum.displacements.empty()) return true;
    for (const size_t v : window.Compose(optimum.displacements, shifts_)) {
      deformed_.values[v] = DeformedSourceAt(level_, shifts_, v);
    }
    const BlockIndex centre = worst->index;
    Measure([&](const Block& b) { return (b.index - centre).cwiseAbs().maxCoeff() <= kReach; });
    return true;
  }

  // What one evaluation of the worst block's cost takes: of all levels a block needs about as many.
  double SecondsOfACost() {
    constexpr int kTries = 5;
    const Block* worst = Worst();
    if (!worst) return 0;
    const BlockWindow window(level_, deformed_, worst->index);
    const std::vector<double> rest(size_t(window.parameters()), 0.0);
    double least = INFINITY;
    for (int n = 0; n < kTries; ++n) {
      const auto start = Pace::Clock::now();
      window.Cost(rest);
      least = std::min(least, std::chrono::duration<double>(Pace::Clock::now() - start).count());
    }
    return least;
  }

 private:
  Block* Worst() {
    Block* worst = nullptr;
    for (Block& block : blocks_) {
      if (Waits(block) && (!worst || block.mismatch > worst->mismatch)) worst = &block;
    }
    return worst;
  }

  // A block that was registered is not taken again at its level: it may stay above the tolerance for ever.
  bool Waits(const Block& block) const { return !block.visited && block.mismatch > tolerance_; }

  uint64_t SeedOf(const BlockIndex& block) const {
    const Eigen::Vector3i size = level_.counts.grid.size;
    const uint64_t number =
        (uint64_t(block.z()) * uint64_t(size.y()) + uint64_t(block.y())) * uint64_t(size.x()) +
        uint64_t(block.x());
    return (seed_ * 8 + uint64_t(level_.number)) * 0x9E3779B97F4A7C15ULL + number;
  }

  template <class Which>
  void Measure(Which which) {
    std::vector<Block*> chosen;
    for (Block& block : blocks_) {
      if (which(block)) chosen.push_back(&block);
    }
    ParallelFor(chosen.size(),
                [&](size_t n) { chosen[n]->mismatch = MismatchOf(level_, deformed_, chosen[n]->index); });
  }

  const PaperLevel& level_;
  uint64_t seed_;
  VoxelShifts& shifts_;
  Volume deformed_;
  std::vector<Block> blocks_;
  double tolerance_;
};

// Looks ahead: the blocks of this level and of finer ones that would be registered if the images were left as
// they are now.
void Foresee(const std::vector<PaperLevel>& levels, size_t level, VoxelShifts shifts, Pace& pace) {
  for (size_t n = level; n < levels.size(); ++n) {
    if (n > level) shifts = RefinedShifts(shifts, levels[n].source.grid);
    LevelRun run(levels[n], 0, shifts);
    pace.Expect(n, double(run.Waiting()), [&] { return run.SecondsOfACost(); });
  }
}

}  // namespace

PaperRegistration RegisterAsPublished(const PaperPair& pair, const PaperOptions& options, Backend& backend,
                                      const Progress& progress) {
  options.Validate();
  const std::vector<PaperLevel> levels = MakePaperLevels(pair, backend);
  PaperRegistration out;
  out.shifts = VoxelShifts(levels.front().source.grid, Eigen::Vector3f::Zero());
  Pace pace(options, levels.size(), progress);
  for (size_t l = 0; l < levels.size(); ++l) {
    if (l > 0) out.shifts = RefinedShifts(out.shifts, levels[l].source.grid);
    if (!pace.Spent()) Foresee(levels, l, out.shifts, pace);
    LevelRun run(levels[l], uint64_t(options.seed), out.shifts);
    int64_t registered = 0;
    while (!pace.Spent() && run.Step()) {
      ++registered;
      pace.Count(l, double(run.Waiting()));
      pace.Report(levels[l].number);
    }
    pace.End(l);
    out.control_points_per_level.push_back(kControlPoints * registered);
  }
  return out;
}

}  // namespace kvx
