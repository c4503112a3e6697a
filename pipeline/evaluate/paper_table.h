// The paper's Tables 2, 3 and 4 of a model: one row per stage, means over its scans.
#pragma once
#include "pipeline/evaluate/evaluate.h"

namespace kvx {

struct PaperRow {
  std::string volume;         // "source", "initialise", "register"
  std::optional<double> med;  // mm, where the truth is known
  Measures measures;
  double folded_fraction = 0;  // of the body
  double seconds = 0;          // per scan, for this stage: finding its bones; registering it
};
std::vector<PaperRow> PaperTable(const Evaluation& evaluation);
std::string PaperTableText(const Evaluation& evaluation);

}  // namespace kvx
