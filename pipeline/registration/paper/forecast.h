// What is said while the published method runs: how much is done, and an honest time for the rest.
#pragma once
#include <string>

#include "pipeline/registration/paper/paper_options.h"

namespace kvx {

struct PaperProgress {
  int64_t blocks = 0;  // registered so far
  double seconds = 0;  // that they took
};
struct PaperForecast {
  std::string text;     // "12 of about 40 blocks, about 30 s left"; no time before three blocks are done
  double fraction = 0;  // done, 0 to 1
};
// `expected`: blocks still to come if no limit ends the run earlier.
PaperForecast ForecastOf(const PaperOptions& options, const PaperProgress& done, double expected);

}  // namespace kvx
