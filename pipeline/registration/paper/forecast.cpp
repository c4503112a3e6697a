// Blocks take about as long as those before them; limits in blocks and in seconds end the run earlier.
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

}  // namespace

PaperForecast ForecastOf(const PaperOptions& options, const PaperProgress& done, double expected) {
  const bool tells_time = done.blocks >= kEnoughToTell && done.seconds > 0;
  const double seconds_a_block = tells_time ? done.seconds / double(done.blocks) : 0;
  double left = expected;
  if (options.max_blocks > 0) left = std::min(left, double(options.max_blocks - done.blocks));
  if (options.max_seconds > 0 && tells_time)
    left = std::min(left, std::max(0.0, options.max_seconds - done.seconds) / seconds_a_block);
  const double all = double(done.blocks) + left;
  char text[60];
  std::snprintf(text, sizeof text, "%lld of about %.0f blocks", static_cast<long long>(done.blocks), all);
  return {text + (tells_time ? TimeText(left * seconds_a_block) : ""), all > 0 ? done.blocks / all : 1.0};
}

}  // namespace kvx
