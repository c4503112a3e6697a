// What is said while the published method runs: how much is done, and an honest time for the rest.
#pragma once
#include <span>
#include <string>

#include "pipeline/registration/paper/paper_options.h"

namespace kvx {

// Of one level, from coarse to fine.
struct PaperPace {
  int64_t blocks = 0;  // registered so far
  double seconds = 0;  // that they took
  double left = 0;     // blocks still to come if no limit ends the run earlier
  double cost = 1;     // of a block, beside those of other levels: until enough of its own are registered
};
struct PaperForecast {
  std::string text;     // "12 of about 40 blocks, about 30 s left"; no time before three blocks are done
  double fraction = 0;  // done, 0 to 1: of the time, and of the blocks until it can be told
};
PaperForecast ForecastOf(const PaperOptions& options, std::span<const PaperPace> levels);

}  // namespace kvx
