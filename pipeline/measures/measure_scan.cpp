// The three rows of the paper's tables for one scan.
#include "pipeline/measures/measure_scan.h"

#include "kernels/blend_deform.h"
#include "pipeline/measures/measures.h"
#include "pipeline/scans/measured_box.h"

namespace kvx {

MeasureScan::Output MeasureScan::Run(const Inputs& inputs, const Options&, StageContext& context) {
  const OwnOrLent<Volume> scan = Measured(inputs.scan->volume);
  const ComparedImages images(inputs.template_scan->volume, *scan);
  const auto measure = [&](const DisplacementField& scan_from_template) {
    return Measure(context.backend, images, *inputs.region, scan_from_template);
  };
  Output out;
  out.by_stage["source"] =
      measure(DisplacementField(inputs.template_scan->volume.grid, Eigen::Vector3f::Zero()));
  context.progress.Report(kName, 0.3);
  out.by_stage["initialise"] = measure(BlendField(context.backend)(*inputs.weights, PoseOf(*inputs.fits)));
  context.progress.Report(kName, 0.6);
  out.by_stage["register"] = measure(inputs.registered->scan_from_template);
  out.control_points = inputs.registered->control_points;
  out.control_points_per_level = inputs.registered->control_points_per_level;
  out.folded_fraction = inputs.registered->folded_fraction;
  out.confidence = inputs.registered->confidence;
  return out;
}

}  // namespace kvx
