// Rounds of Algorithm 1 over resolution levels, from coarse to fine, and the map that they end in. After each
// round but the last the tissue settles: what the scan shows clearly is held, and what it does not (along
// edges and fibres, in creases) goes where an elastic body would go. The next round starts there, and what
// looks different in both images although it has been registered counts less in it.
#include "pipeline/registration/register_scan.h"

#include <iterator>
#include <optional>

#include "core/host/parallel.h"
#include "core/voxels/finer_grid.h"
#include "pipeline/artifacts/held.h"
#include "pipeline/registration/blocks/adaptive_sweeps.h"
#include "pipeline/registration/blocks/level_builder.h"
#include "pipeline/registration/cubed_template.h"
#include "pipeline/registration/images/disagreement.h"
#include "pipeline/registration/images/outliers.h"
#include "pipeline/registration/images/place_information.h"
#include "pipeline/registration/paper/paper_stage.h"
#include "pipeline/registration/region/level_field.h"
#include "pipeline/registration/result/confidence.h"
#include "pipeline/registration/tissue/bone_coat.h"
#include "pipeline/registration/tissue/elastic_start.h"
#include "pipeline/registration/tissue/fold_repair.h"
#include "pipeline/scans/extremes.h"
#include "pipeline/scans/grey_kind.h"

namespace kvx {
namespace {

// On every level, round by round. Long waves of the error rest late, and in the first round there are more of
// them: wide blocks take them up, once on each lattice. What settled tissue still lacks is found by few; wide
// blocks there, or in more sweeps, made tissue worse that hardly moves.
constexpr SweepCounts kSweepsOfRounds[] = {{6, 2}, {3, 0}};
constexpr int kRounds = std::size(kSweepsOfRounds);
// Of levels for starts from far off, in any round: as many as it takes, since every sweep comes nearer by
// part of a block. What a wide block covers moves in more ways there than it can.
constexpr SweepCounts kSweepsFarOff = {40, 0};
// Of the tissue beside what images say, in the units of their energy and per frame of a voxel. It is so
// little that it decides only where they say next to nothing.
constexpr float kTissueStiffness = 0.02f;

// All levels, coarse to fine, of which the finest is left; adds to `out` the control points that they took.
// Returns how sure the last round is, on the finest level (LevelOutcome).
std::vector<float> RegisterLevels(std::vector<BlockLevel>& levels, int round, Backend& backend,
                                  const Progress& progress, std::vector<FieldVector>& field,
                                  RegisteredScan& out) {
  std::vector<float> variances_mm2;
  const bool last_round = round + 1 == kRounds;
  const size_t count = levels.size();
  std::vector<int64_t>& points = out.control_points_per_level;
  if (points.size() < count) points.insert(points.begin(), count - points.size(), 0);
  field.assign(levels.back().grid.VoxelCount(), FieldVector::Zero());
  for (size_t l = count; l-- > 0;) {
    if (l + 1 < count) {
      field = Refined(field, levels[l + 1].grid, levels[l]);
      levels.pop_back();
    }
    const Progress part =
        progress.Part(double(count - 1 - l) / double(count), double(count - l) / double(count));
    const SweepCounts& sweeps = l < kNearLevels ? kSweepsOfRounds[round] : kSweepsFarOff;
    LevelOutcome outcome = RegisterLevel(levels[l], backend, part, sweeps, last_round && l == 0, field);
    variances_mm2 = std::move(outcome.variances_mm2);
    points[points.size() - 1 - l] += kControlPoints * outcome.blocks;
    out.control_points += kControlPoints * outcome.blocks;
  }
  return variances_mm2;
}

// How firmly tissue is held where the scan shows it. `finest`: the level that has just been registered.
std::vector<Eigen::Matrix3f> Holds(const BlockLevel& finest, const std::vector<Eigen::Vector3f>& scan_mm) {
  std::vector<Eigen::Matrix3f> holds = PlaceInformation(finest, scan_mm);
  for (Eigen::Matrix3f& hold : holds) hold /= kTissueStiffness;
  return holds;
}

// `times`: voxels of the template in the place of one that was measured.
RegisteredScan RegisterAdaptively(const RegistrationInputs& inputs, const Eigen::Vector3i& times,
                                  StageContext& context) {
  const PoseVector pose = PoseOf(*inputs.fits);
  const WorkRegion region = RegionOfLevels(*inputs.body);
  const LabelMap& bones = inputs.bones->labels;
  const Volume beyond_coat_mm = BeyondBoneCoatMm(bones, region);
  const ElasticTissue tissue(bones, *inputs.body, beyond_coat_mm, region, context.backend);
  std::vector<Eigen::Vector3f> scan_mm;
  std::optional<LevelBuilder> builder;
  SideBySide([&] { scan_mm = ElasticStart(*inputs.weights, tissue, pose, region, context.progress); },
             [&] { builder.emplace(inputs, times, beyond_coat_mm, region, context.backend); });
  RegisteredScan out;
  LeftOpen left_open;
  for (int round = 0; round < kRounds; ++round) {
    Unfold(bones, *inputs.body, region, context.progress, scan_mm);
    std::vector<BlockLevel> levels = builder->Build(scan_mm);
    const bool last = round + 1 == kRounds;
    std::vector<float> weights;  // before outliers count less
    if (last) weights = levels.front().weight;
    if (round > 0) CountOutliersLess(scan_mm, levels);
    const Progress part = context.progress.Part(double(round) / kRounds, double(round + 1) / kRounds);
    std::vector<FieldVector> field;
    left_open.variances_mm2 = RegisterLevels(levels, round, context.backend, part, field, out);
    scan_mm = StartAfter(scan_mm, region, field);
    if (last) {
      levels.front().weight = std::move(weights);
      left_open.slopes = SharedSlopesOfBlocks(levels.front(), scan_mm);
      left_open.disagreement = DisagreementAround(levels.front(), scan_mm);
      break;
    }
    const std::vector<Eigen::Matrix3f> holds = Holds(levels.front(), scan_mm);
    levels.clear();  // the tissue needs the room
    field = std::vector<FieldVector>();
    tissue.Relax(holds, context.progress, scan_mm);
  }
  Unfold(bones, *inputs.body, region, context.progress, scan_mm);
  out.scan_from_template = OnTemplate(*inputs.weights, pose, region, scan_mm);
  out.folded_fraction = FoldedFraction(out.scan_from_template, *inputs.body);
  out.place_error_steps = PlaceErrorSteps(inputs, builder->images(), region, left_open, scan_mm);
  out.confidence = Summarise(out.place_error_steps, *inputs.body);
  return out;
}

// As it is, or what it shows without extremes.
Artifact<Scan> AsSeen(const Artifact<Scan>& scan) {
  OwnOrLent<Volume> seen = WithoutExtremes(scan->volume, IsHounsfield(scan->volume, scan->modality));
  if (seen.lent()) return scan;
  return Held(With(std::move(seen).Taken(), *scan));
}

}  // namespace

RegisteredScan RegisterScan::Run(const Inputs& given, const Options& options, StageContext& context) {
  if (options.method == RegistrationMethod::kPaper) return RegisterByPaper(given, options.paper, context);
  const Artifact<Scan> template_scan = AsSeen(given.template_scan), scan = AsSeen(given.scan);
  const Inputs inputs{template_scan, given.body, given.bones, given.weights, given.fits, scan};
  const Eigen::Vector3i times = TimesTowardsCubes(inputs.body->grid);
  if ((times.array() == 1).all()) return RegisterAdaptively(inputs, times, context);
  const CubedTemplate cubed(inputs, times);
  return AtTemplateVoxels(RegisterAdaptively(cubed.Inputs(), times, context), inputs, times,
                          context.progress);
}

}  // namespace kvx
