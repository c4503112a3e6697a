// Means over the scans that have a value.
#include "pipeline/evaluate/paper_table.h"

#include <cmath>
#include <cstdio>

namespace kvx {
namespace {

double SecondsAScan(const Evaluation& evaluation, const std::string& stage) {
  const auto found = evaluation.seconds.find(stage == "initialise" ? "register_bones" : stage);
  if (found == evaluation.seconds.end() || evaluation.scans.empty()) return 0;
  return found->second / double(evaluation.scans.size());
}

PaperRow RowOf(const Evaluation& evaluation, const std::string& stage) {
  PaperRow row{.volume = stage, .seconds = SecondsAScan(evaluation, stage)};
  const double count = double(evaluation.scans.size());
  double med = 0, known = 0;
  for (const ScanEvaluation& scan : evaluation.scans) {
    const auto m = scan.measures.find(stage);
    if (m != scan.measures.end()) {
      row.measures.ssd += m->second.ssd / count;
      row.measures.cc += m->second.cc / count;
      row.measures.mi += m->second.mi / count;
    }
    if (const auto f = scan.folded_by_stage.find(stage); f != scan.folded_by_stage.end()) {
      row.folded_fraction += f->second / count;
    }
    if (const auto d = scan.distances.find(stage); d != scan.distances.end() && !std::isnan(d->second.all))
      med += d->second.all, known += 1;
  }
  if (known > 0) row.med = med / known;
  return row;
}

}  // namespace

std::vector<PaperRow> PaperTable(const Evaluation& evaluation) {
  if (evaluation.scans.empty()) return {};
  return {RowOf(evaluation, "source"), RowOf(evaluation, "initialise"), RowOf(evaluation, "register")};
}

std::string PaperTableText(const Evaluation& evaluation) {
  char line[160];
  std::snprintf(line, sizeof line, "%-11s %8s %7s %6s %6s %9s %9s   mean of %zu scans\n", "volume",
                "MED (mm)", "SSD", "CC", "MI", "folded %", "s a scan", evaluation.scans.size());
  std::string out = line;
  for (const PaperRow& row : PaperTable(evaluation)) {
    char med[16] = "-";
    if (row.med) std::snprintf(med, sizeof med, "%.2f", *row.med);
    std::snprintf(line, sizeof line, "%-11s %8s %7.1f %6.2f %6.2f %9.4f %9.1f\n", row.volume.c_str(), med,
                  row.measures.ssd, row.measures.cc, row.measures.mi, 100 * row.folded_fraction, row.seconds);
    out += line;
  }
  return out + "\n";
}

}  // namespace kvx
