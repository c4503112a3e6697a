// Blocks take about as long as those of their level; limits in blocks and in seconds end the run earlier.
#include "pipeline/registration/paper/forecast.h"

#include <algorithm>
#include <cmath>
#include <cstdio>

namespace kvx {
namespace {

constexpr int64_t kEnoughToTell = 3;  // blocks

std::string TimeText(double seconds) {
  const bool minutes = seconds >= 120;
  char text[40];
  std::snprintf(text, sizeof text, ", about %.0f %s left", std::ceil(minutes ? seconds / 60 : seconds),
                minutes ? "min" : "s");
  return text;
}

struct Amount {
  double blocks = 0, seconds = 0;
};

// Of a block of the level: as its own took, else by its cost beside all that are done.
double SecondsABlock(const PaperPace& level, std::span<const PaperPace> levels) {
  if (level.blocks >= kEnoughToTell) return level.seconds / double(level.blocks);
  double seconds = 0, cost = 0;
  for (const PaperPace& other : levels) seconds += other.seconds, cost += other.cost * double(other.blocks);
  return cost > 0 ? level.cost * seconds / cost : 0;
}

Amount DoneOf(std::span<const PaperPace> levels) {
  Amount done;
  for (const PaperPace& level : levels) done.blocks += double(level.blocks), done.seconds += level.seconds;
  return done;
}

// Level by level, until a limit is reached.
Amount LeftOf(const PaperOptions& options, std::span<const PaperPace> levels, const Amount& done) {
  Amount left;
  for (const PaperPace& level : levels) {
    const double seconds = SecondsABlock(level, levels);
    double blocks = level.left;
    if (options.max_blocks > 0)
      blocks = std::min(blocks, std::max(0.0, double(options.max_blocks) - done.blocks - left.blocks));
    if (options.max_seconds > 0 && done.blocks >= kEnoughToTell && seconds > 0)
      blocks = std::min(blocks, std::max(0.0, options.max_seconds - done.seconds - left.seconds) / seconds);
    left.blocks += blocks, left.seconds += blocks * seconds;
  }
  return left;
}

}  // namespace

PaperForecast ForecastOf(const PaperOptions& options, std::span<const PaperPace> levels) {
  const Amount done = DoneOf(levels), left = LeftOf(options, levels, done);
  const bool tells_time = done.blocks >= kEnoughToTell && done.seconds > 0;
  const double all = done.blocks + left.blocks;
  char text[60];
  std::snprintf(text, sizeof text, "%.0f of about %.0f blocks", done.blocks, all);
  const double fraction = tells_time ? done.seconds / (done.seconds + left.seconds)
                          : all > 0  ? done.blocks / all
                                     : 1.0;
  return {text + (tells_time ? TimeText(left.seconds) : ""), fraction};
}

}  // namespace kvx
