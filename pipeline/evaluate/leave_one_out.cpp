// Each example predicted from the others, as far as the pose space decides it.
#include "pipeline/evaluate/leave_one_out.h"

#include "pipeline/posing/without_scan.h"

namespace kvx {
namespace {

constexpr size_t kPoints = 20000;  // body voxels looked at, spread evenly in memory order

std::vector<PointMm> BodyPoints(const Mask& body) {
  std::vector<PointMm> points;
  for (const size_t v : SpreadVoxels(body, kPoints))
    points.push_back(body.grid.ToMm(PointVox{body.grid.Ijk(v).cast<double>()}));
  return points;
}

double MeanDistance(const std::vector<PointMm>& a, const std::vector<PointMm>& b) {
  double sum = 0;
  for (size_t i = 0; i < a.size(); ++i) sum += (a[i].lps - b[i].lps).norm();
  return a.empty() ? 0.0 : sum / double(a.size());
}

}  // namespace

std::vector<LeftOutEvaluation> LeaveOneOut(const Model& model, const PosingEngine& engine,
                                           const Progress& progress) {
  const std::vector<PointMm> points = BodyPoints(model.body());
  const int scans = int(model.scan_names().size());
  std::vector<LeftOutEvaluation> out;
  for (int k = 0; k < scans; ++k) {
    progress.Report("leave one out", double(k) / double(scans));
    const Artifact<RegisteredScan> registered = model.LoadRegistered(k);
    const Grid& grid = registered->scan_from_template.grid;
    std::vector<PointMm> reached = points;
    for (PointMm& x : reached) x.lps += SampleTrilinear(registered->scan_from_template, grid.ToVox(x));
    LeftOutEvaluation row{model.scan_names()[size_t(k)], {}};
    const ResolvedPose pose = ResolveWithout(model.Resolver(), model.space_options(), model.moments(), k);
    for (const auto& [mode, name] : kDeformationModes)
      row.distance_mm[mode] = MeanDistance(reached, engine.MapPoints(InMode(pose, mode), points));
    out.push_back(row);
  }
  return out;
}

}  // namespace kvx
