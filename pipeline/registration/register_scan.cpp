// Algorithm 1 over resolution levels, from coarse to fine, and the map that it ends in.
#include "pipeline/registration/register_scan.h"

#include "pipeline/registration/adaptive_sweeps.h"
#include "pipeline/registration/confidence.h"
#include "pipeline/registration/elastic_start.h"
#include "pipeline/registration/fold_repair.h"
#include "pipeline/registration/level_builder.h"
#include "pipeline/registration/level_field.h"
#include "pipeline/registration/paper/paper_stage.h"

namespace kvx {
namespace {

PoseVector PoseOf(const BoneFits& fits) {
  PoseVector pose;
  for (const BoneFit& fit : fits) pose.push_back(fit.scan_from_template);
  return pose;
}

}  // namespace

RegisteredScan RegisterScan::Run(const Inputs& inputs, const Options& options, StageContext& context) {
  if (options.method == RegistrationMethod::kPaper) return RegisterByPaper(inputs, options.paper, context);
  const PoseVector pose = PoseOf(*inputs.fits);
  const WorkRegion region = RegionAround(*inputs.body);
  std::vector<Eigen::Vector3f> scan_mm =
      ElasticStart(*inputs.weights, inputs.bones->labels, *inputs.body, pose, region);
  const std::vector<BlockLevel> levels = BuildLevels(inputs, scan_mm, region, context.backend);
  RegisteredScan out;
  std::vector<FieldVector> field(levels.back().grid.VoxelCount(), FieldVector::Zero());
  std::vector<float> confidence;  // of the finest level
  const int count = int(levels.size());
  for (int l = count; l-- > 0;) {
    if (l + 1 < count) field = Refined(field, levels[l + 1], levels[l]);
    const Progress part = context.progress.Part(double(count - 1 - l) / count, double(count - l) / count);
    LevelOutcome outcome = RegisterLevel(levels[l], context.backend, part, field);
    out.control_points_per_level.push_back(kControlPoints * outcome.blocks);
    confidence = std::move(outcome.confidence);
    out.control_points += out.control_points_per_level.back();
  }
  scan_mm = Composed(scan_mm, region, field);
  Unfold(inputs.bones->labels, *inputs.body, region, scan_mm);
  out.scan_from_template = OnTemplate(*inputs.weights, pose, region, scan_mm);
  out.folded_fraction = FoldedFraction(out.scan_from_template, *inputs.body);
  out.confidence_percent = ConfidencePercent(inputs, region, confidence, scan_mm);
  out.confidence = Summarise(out.confidence_percent, *inputs.body);
  return out;
}

}  // namespace kvx
