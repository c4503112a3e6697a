// Lines of fixed columns, and means over scans.
#include "pipeline/evaluate/report.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <nlohmann/json.hpp>

#include "pipeline/evaluate/paper_table.h"
#include "pipeline/measures/measures_json.h"

namespace kvx {
namespace {

using Json = nlohmann::ordered_json;

template <class... Args>
std::string Line(const char* format, Args... args) {
  char text[256];
  std::snprintf(text, sizeof text, format, args...);
  return text;
}

// NaN without values; NaNs among them say that a scan shows nothing of the kind.
template <class T, class Value>
double MeanOf(const std::vector<T>& all, const Value& value) {
  double sum = 0;
  int count = 0;
  for (const T& one : all) {
    const double v = value(one);
    if (!std::isnan(v)) sum += v, ++count;
  }
  return count ? sum / count : std::numeric_limits<double>::quiet_NaN();
}

// Means over scans of what the scans have at `stage`.
struct StageMean {
  Measures measures;
  Distances distances;
  size_t measured = 0, known = 0;
};

StageMean MeanOf(const std::vector<Measures>& measures, const std::vector<Distances>& distances) {
  StageMean mean{.measured = measures.size(), .known = distances.size()};
  mean.measures = {MeanOf(measures, [](const Measures& m) { return m.ssd; }),
                   MeanOf(measures, [](const Measures& m) { return m.cc; }),
                   MeanOf(measures, [](const Measures& m) { return m.mi; })};
  mean.distances.all = MeanOf(distances, [](const Distances& d) { return d.all; });
  mean.distances.soft = MeanOf(distances, [](const Distances& d) { return d.soft; });
  mean.distances.joint = MeanOf(distances, [](const Distances& d) { return d.joint; });
  mean.distances.p95 = MeanOf(distances, [](const Distances& d) { return d.p95; });
  return mean;
}

StageMean MeanOfScans(const std::vector<ScanEvaluation>& scans, const std::string& stage) {
  std::vector<Measures> measures;
  std::vector<Distances> distances;
  for (const ScanEvaluation& scan : scans) {
    if (const auto m = scan.measures.find(stage); m != scan.measures.end()) measures.push_back(m->second);
    if (const auto d = scan.distances.find(stage); d != scan.distances.end()) distances.push_back(d->second);
  }
  return MeanOf(measures, distances);
}

StageMean MeanOfUnseen(const std::vector<UnseenEvaluation>& poses, const std::string& mode) {
  std::vector<Distances> distances;
  for (const UnseenEvaluation& pose : poses) distances.push_back(pose.distances.at(mode));
  return MeanOf({}, distances);
}

std::string Mm(double value, int width) {
  return std::isnan(value) ? Line("%*s", width, "-") : Line("%*.2f", width, value);
}

std::string DistanceColumns(const Distances& d) {
  return " " + Mm(d.all, 7) + " " + Mm(d.soft, 7) + " " + Mm(d.joint, 7) + " " + Mm(d.p95, 7);
}

std::string Row(const std::string& name, const std::string& stage, const Measures& m, const Distances* d) {
  return Line("%-14s %-11s %7.1f %6.2f %6.2f", name.c_str(), stage.c_str(), m.ssd, m.cc, m.mi) +
         (d ? " |" + DistanceColumns(*d) : "") + "\n";
}

const std::vector<std::string> kStages{"source", "initialise", "register"};

std::string ScanTable(const Evaluation& e) {
  const bool truth =
      std::ranges::any_of(e.scans, [](const ScanEvaluation& scan) { return !scan.distances.empty(); });
  std::string out = Line("%-14s %-11s %7s %6s %6s", "scan", "stage", "SSD", "CC", "MI");
  out += truth ? " |     MED    soft   joint     95% (mm)\n" : "\n";
  for (const ScanEvaluation& scan : e.scans) {
    for (const std::string& stage : kStages) {
      const auto d = scan.distances.find(stage);
      const auto m = scan.measures.find(stage);
      if (m != scan.measures.end())
        out += Row(scan.name, stage, m->second, d == scan.distances.end() ? nullptr : &d->second);
    }
  }
  for (const std::string& stage : kStages) {
    const StageMean mean = MeanOfScans(e.scans, stage);
    if (mean.measured == 0) continue;
    out += Row("mean of " + std::to_string(mean.measured), stage, mean.measures,
               mean.known ? &mean.distances : nullptr);
  }
  return out;
}

std::string BoneTable(const Evaluation& e) {
  std::string out;
  for (const ScanEvaluation& scan : e.scans) {
    for (const BoneError& bone : scan.bone_errors) {
      out += Line("%-14s %-22s %7.2f deg %7.2f mm\n", scan.name.c_str(), bone.bone.c_str(), bone.rotation_deg,
                  bone.translation_mm);
    }
  }
  return out.empty() ? out : "\nbones against the truth: rotation, translation at the centroid\n" + out;
}

std::string TissueTable(const Evaluation& e) {
  std::map<std::string, std::map<std::string, std::vector<double>>>
      rows;  // tissue, stage, scans that show it
  for (const ScanEvaluation& scan : e.scans) {
    for (const auto& [stage, d] : scan.distances) {
      for (const auto& [tissue, med] : d.by_tissue) rows[tissue][stage].push_back(med);
    }
  }
  std::string out;
  for (auto& [tissue, by_stage] : rows) {
    const auto mean = [&](const char* stage) { return MeanOf(by_stage[stage], [](double v) { return v; }); };
    out +=
        Line("%-20s ", tissue.c_str()) + Mm(mean("initialise"), 10) + " " + Mm(mean("register"), 10) + "\n";
  }
  return out.empty() ? out : "\nMED by tissue (mm)   initialise   register\n" + out;
}

std::string UnseenTable(const Evaluation& e) {
  if (e.unseen.empty()) return {};
  std::string out = "\nunseen poses, posed by their true bones: MED, soft, joint, 95% (mm)\n";
  for (const UnseenEvaluation& pose : e.unseen) {
    for (const auto& [mode, name] : kDeformationModes) {
      out += Line("%-14s %-7s", pose.name.c_str(), name) + DistanceColumns(pose.distances.at(name)) +
             Line("   extrapolation %.2f\n", pose.extrapolation);
    }
  }
  for (const auto& [mode, name] : kDeformationModes) {
    out += Line("%-14s %-7s", "mean", name) + DistanceColumns(MeanOfUnseen(e.unseen, name).distances) + "\n";
  }
  return out;
}

std::string LeftOutTable(const Evaluation& e) {
  if (e.left_out.empty()) return {};
  std::string out =
      "\nleave one out: distance from the scan's registered correspondence over the body (mm)\n";
  for (const LeftOutEvaluation& row : e.left_out) {
    out += Line("%-14s", row.name.c_str());
    for (const auto& [mode, name] : kDeformationModes)
      out += Line(" %s %7.2f  ", name, row.distance_mm.at(mode));
    out += "\n";
  }
  return out;
}

// " (levels, coarse to fine: 80 + 640 + 5120)"
std::string PerLevel(const std::vector<int64_t>& points) {
  if (points.empty()) return "";
  std::string sum;
  for (const int64_t of_level : points) sum += (sum.empty() ? "" : " + ") + std::to_string(of_level);
  return " (levels, coarse to fine: " + sum + ")";
}

std::string CostTable(const Evaluation& e) {
  std::string out = "\nfolds, control points, confidence\n";
  for (const ScanEvaluation& scan : e.scans) {
    out += Line("%-14s folded %.4f %% of the body, %lld control points%s", scan.name.c_str(),
                100 * scan.folded_fraction, static_cast<long long>(scan.control_points),
                PerLevel(scan.control_points_per_level).c_str());
    if (scan.confidence)
      out += Line(", confidence %.0f %%, unsure in %.0f %%", scan.confidence->mean_percent,
                  100 * scan.confidence->unsure_fraction);
    for (const auto& [name, d] : scan.by_confidence)
      if (!std::isnan(d.all)) out += Line("; MED %s %.2f mm", name.c_str(), d.all);
    out += "\n";
  }
  out += "\nseconds:";
  for (const auto& [stage, seconds] : e.seconds) out += Line(" %s %.1f", stage.c_str(), seconds);
  return out + "\n";
}

Json ToJson(const Distances& d) {
  return {{"med", d.all}, {"soft", d.soft},     {"joint", d.joint},        {"p95", d.p95},
          {"max", d.max}, {"points", d.points}, {"lost", d.lost_fraction}, {"by_tissue", d.by_tissue}};
}

Json ToJson(const PaperRow& row) {
  Json out{{"volume", row.volume}, {"med", nullptr}};
  if (row.med) out["med"] = *row.med;
  out.update(ToJson(row.measures));
  out["folded_fraction"] = row.folded_fraction;
  out["seconds"] = row.seconds;
  return out;
}

template <class T>
Json ToJson(const std::map<std::string, T>& by_name) {
  Json out = Json::object();
  for (const auto& [name, value] : by_name) out[name] = ToJson(value);
  return out;
}

Json MeanJson(const StageMean& mean) {
  Json out = Json::object();
  if (mean.measured) out = ToJson(mean.measures);
  if (!mean.known) return out;
  out["med"] = mean.distances.all, out["soft"] = mean.distances.soft;
  out["joint"] = mean.distances.joint, out["p95"] = mean.distances.p95;
  return out;
}

Json ScanJson(const ScanEvaluation& scan) {
  Json bones = Json::object();
  for (const BoneError& e : scan.bone_errors)
    bones[e.bone] = {{"rotation_deg", e.rotation_deg}, {"translation_mm", e.translation_mm}};
  return {{"name", scan.name},
          {"measures", ToJson(scan.measures)},
          {"control_points", scan.control_points},
          {"control_points_per_level", scan.control_points_per_level},
          {"folded_fraction", scan.folded_fraction},
          {"folded_by_stage", scan.folded_by_stage},
          {"confidence_percent", scan.confidence ? Json(scan.confidence->mean_percent) : Json()},
          {"unsure_fraction", scan.confidence ? Json(scan.confidence->unsure_fraction) : Json()},
          {"by_confidence", ToJson(scan.by_confidence)},
          {"distances", ToJson(scan.distances)},
          {"bone_errors", bones}};
}

}  // namespace

std::string EvaluationText(const Evaluation& evaluation) {
  return PaperTableText(evaluation) + ScanTable(evaluation) + BoneTable(evaluation) +
         TissueTable(evaluation) + UnseenTable(evaluation) + LeftOutTable(evaluation) + CostTable(evaluation);
}

std::string EvaluationJson(const Evaluation& evaluation) {
  Json document{{"table", Json::array()}, {"scans", Json::array()}, {"mean", Json::object()}};
  for (const PaperRow& row : PaperTable(evaluation)) document["table"].push_back(ToJson(row));
  for (const ScanEvaluation& scan : evaluation.scans) document["scans"].push_back(ScanJson(scan));
  for (const std::string& stage : kStages)
    document["mean"][stage] = MeanJson(MeanOfScans(evaluation.scans, stage));
  for (const UnseenEvaluation& pose : evaluation.unseen) {
    document["unseen"].push_back(
        {{"name", pose.name}, {"extrapolation", pose.extrapolation}, {"distances", ToJson(pose.distances)}});
  }
  if (!evaluation.unseen.empty()) {
    for (const auto& [mode, name] : kDeformationModes)
      document["mean"][name] = MeanJson(MeanOfUnseen(evaluation.unseen, name));
  }
  for (const LeftOutEvaluation& row : evaluation.left_out) {
    Json left_out{{"name", row.name}};
    for (const auto& [mode, name] : kDeformationModes)
      left_out[name + std::string("_mm")] = row.distance_mm.at(mode);
    document["leave_one_out"].push_back(left_out);
  }
  document["seconds"] = evaluation.seconds;
  document["warnings"] = evaluation.warnings;
  return document.dump(1);
}

}  // namespace kvx
