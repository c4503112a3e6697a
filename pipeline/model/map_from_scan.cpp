// Through the registered correspondence and its inverse.
#include "pipeline/model/map_from_scan.h"

#include <limits>

#include "core/host/parallel.h"
#include "pipeline/registration/result/confidence.h"
#include "pipeline/registration/result/inverse_map.h"

namespace kvx {

std::vector<PointMm> MapPointsFromScan(const Model& model, const std::string& scan,
                                       const std::vector<PointMm>& in_scan) {
  if (scan == model.manifest().template_scan) return in_scan;
  const int k = ScanIndex(model, scan);
  const Artifact<RegisteredScan> registered = model.LoadRegistered(k);
  const BorderedField scan_from_template = Bordered(model, k, registered->scan_from_template);
  const InverseMap template_from_scan(scan_from_template, model.body(), model.LoadScanVolume(k)->volume.grid);
  const PointMm nowhere{Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN())};
  std::vector<PointMm> out(in_scan.size());
  ParallelEach(out.size(), [&](size_t i) { out[i] = template_from_scan(in_scan[i]).value_or(nowhere); });
  return out;
}

DisplacementField ScanFromTemplate(const Model& model, const std::string& scan) {
  return model.LoadRegistered(ScanIndex(model, scan))->scan_from_template;
}

DisplacementField TemplateFromScan(const Model& model, const std::string& scan, const Progress& progress) {
  const int k = ScanIndex(model, scan);
  const Artifact<RegisteredScan> registered = model.LoadRegistered(k);
  return InverseField(Bordered(model, k, registered->scan_from_template), model.body(),
                      model.LoadScanVolume(k)->volume.grid, progress);
}

namespace {

const Mask& Stated(const Mask& map) {
  if (map.values.empty())
    throw NotFound(
        "the method that this model was built with states no confidence; build it with --method adaptive");
  return map;
}

}  // namespace

Volume ConfidenceOf(const Model& model, const std::string& scan) {
  const Artifact<RegisteredScan> registered = model.LoadRegistered(ScanIndex(model, scan));
  const Mask percent = ConfidencePercent(Stated(registered->place_error_steps));
  Volume out(percent.grid);
  for (size_t v = 0; v < out.values.size(); ++v) out.values[v] = float(percent.values[v]);
  return out;
}

Volume PlaceErrorOf(const Model& model, const std::string& scan) {
  const Artifact<RegisteredScan> registered = model.LoadRegistered(ScanIndex(model, scan));
  return PlaceErrorMm(Stated(registered->place_error_steps));
}

}  // namespace kvx
