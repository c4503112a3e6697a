// Coarse scores, refinement, non-maximum suppression.
#include "pipeline/bones/search/bone_search.h"

#include <algorithm>
#include <numeric>
#include <span>

#include "core/host/parallel.h"
#include "pipeline/bones/images/levels.h"
#include "pipeline/bones/refine/pose_hint.h"
#include "pipeline/bones/search/candidate_poses.h"

namespace kvx {
namespace {

constexpr size_t kClimbing = 512, kRefinedRoot = 160, kRefined = 32, kNarrowed = 12, kKept = 4;
constexpr size_t kBatch = 1 << 16;
// Of many poses, each is first glanced at with so few samples; the best ones are looked at.
constexpr size_t kGlance = 60, kLooks = 12000, kLooksPart = 8, kMostLooks = size_t(1) << 19;

bool Better(const Candidate& a, const Candidate& b) { return a.nats > b.nats; }

std::vector<RigidTransform> AllNear(const BoneShape& bone, const std::vector<RigidTransform>& starts) {
  std::vector<RigidTransform> all;
  for (const RigidTransform& start : starts) {
    const std::vector<RigidTransform> near = LocalCandidates(bone, start);
    all.insert(all.end(), near.begin(), near.end());
  }
  return all;
}

PoseList ListOf(const std::vector<RigidTransform>& poses) {
  return {poses.size(), [&poses](size_t n) { return poses[n]; }};
}

}  // namespace

std::vector<Candidate> Climb(
    const BoneShape& bone, std::vector<Candidate> from, std::span<const double> steps_mm,
    const std::function<std::vector<Candidate>(const std::vector<RigidTransform>&)>& measure) {
  for (const double step_mm : steps_mm) {
    std::vector<RigidTransform> beside;
    for (const Candidate& candidate : from) {
      const auto poses = PosesBeside(bone, candidate.pose, step_mm);
      beside.insert(beside.end(), poses.begin(), poses.end());
    }
    const std::vector<Candidate> measured = measure(beside);
    const size_t each = from.empty() ? 0 : measured.size() / from.size();
    for (size_t c = 0; c < measured.size(); ++c) {
      if (Better(measured[c], from[c / each])) from[c / each] = measured[c];
    }
  }
  return from;
}

double FinestMm(const Grid& template_grid, const Grid& scan_grid) {
  return std::max(template_grid.MeanSpacingMm(), scan_grid.MeanSpacingMm());
}

BoneSearch::BoneSearch(const SoughtBones& sought, const Volume& scan, Backend& backend,
                       const std::map<std::string, RigidTransform>& hints, const Progress& progress)
    : sought_(sought),
      scan_levels_(MakeLevels(scan, sought.CoarserLevelsMm())),
      scores_(backend),
      progress_(progress) {
  for (const Volume& level : scan_levels_) device_levels_.emplace_back(backend, level);
  for (const auto& [name, pose] : hints) {
    const int bone = bones().IndexOf(name);
    if (MayBeMeant(bones(), pose, bone, scan.grid)) hints_[bone] = pose;
  }
}

BoneSearch BoneSearch::TryingAlso(std::map<int, RigidTransform> places) const {
  BoneSearch out = *this;
  out.also_tried_ = std::move(places);
  return out;
}

BoneSearch BoneSearch::CountingWeakMatches() const {
  BoneSearch out = *this;
  out.weak_matches_count_ = true;
  return out;
}

double BoneSearch::MatchNats(int bone, const Candidate& candidate) const {
  const double nats = EvidenceNats(candidate.correlation, candidate.inside, independent_samples()[bone]);
  if (!weak_matches_count_) return nats;
  return nats + WeakMatchNats(candidate.correlation, candidate.inside, independent_samples()[bone]);
}

const RigidTransform* BoneSearch::HintOf(int bone) const {
  const auto hint = hints_.find(bone);
  return hint == hints_.end() ? nullptr : &hint->second;
}

double BoneSearch::HintNats(int bone, const RigidTransform& pose) const {
  const RigidTransform* hint = HintOf(bone);
  if (!hint || !IsNearHint(bones().bones[bone], *hint, pose)) return 0;
  return 0.3 * independent_samples()[bone];  // outweighs evidence that hardly decides, not evidence that does
}

double BoneSearch::PriorNats(int bone, const RigidTransform& pose, const PartialPose& placed) const {
  if (sought_.IsRoot(bone)) return RootNats(pose) + HintNats(bone, pose);
  const RigidTransform& parent_pose = *placed[bones().bones[bone].parent];
  const BoneShape &shape = anatomy().bones[bone], &parent = anatomy().bones[bones().bones[bone].parent];
  const JointShape& joint = anatomy().joints[bone];
  const double change = GapChangeMm(shape, parent, joint, parent_pose.Inverse() * pose);
  return JointNats(JointStateOf(shape, joint, parent_pose, pose), shape) +
         GapNats(change, shape, anatomy().voxel_mm) + HintNats(bone, pose);
}

// Of a pose that refinement will move yet: no gap, and a joint is not blamed for the steps between the tried
// poses.
double BoneSearch::CoarsePriorNats(int bone, const RigidTransform& pose, const PartialPose& placed) const {
  if (sought_.IsRoot(bone)) return RootNats(pose) + HintNats(bone, pose);
  const BoneShape& shape = anatomy().bones[bone];
  const JointState state =
      JointStateOf(shape, anatomy().joints[bone], *placed[bones().bones[bone].parent], pose);
  return JointNats(state, shape, StepMm(shape)) + HintNats(bone, pose);
}

std::vector<Candidate> BoneSearch::Measured(int bone, const std::vector<RigidTransform>& poses,
                                            const PartialPose& placed, int step) const {
  const BoneSamples& samples = sought_.FirstSamplesOf(bone);
  const DeviceScan& scan = DeviceLevelOf(bone);
  const double looked_at = double(std::max<size_t>(1, SamplesAtStep(samples.points.size(), step)));
  std::vector<Candidate> out(poses.size());
  std::vector<VoxFromSample> batch;
  for (size_t begin = 0; begin < poses.size(); begin += kBatch) {
    ThrowIfCancelled();
    batch.resize(std::min(poses.size() - begin, kBatch));
    ParallelEach(batch.size(),
                 [&](size_t c) { batch[c] = ToScanVoxels(scan.grid, poses[begin + c], samples.centre_mm); });
    const std::vector<CorrelationSums> sums = scores_(scan, samples.points, batch, step);
    ParallelEach(batch.size(), [&](size_t c) {
      Candidate& candidate = out[begin + c];
      candidate.pose = poses[begin + c];
      candidate.correlation = Correlation(sums[c]);
      candidate.inside = sums[c].count / looked_at;
      candidate.nats = MatchNats(bone, candidate) + CoarsePriorNats(bone, candidate.pose, placed);
    });
  }
  return out;
}

// Of many poses, by their numbers: those that a glance with few samples finds most likely, in their order.
std::vector<RigidTransform> BoneSearch::WorthALook(int bone, const PoseList& poses, size_t count,
                                                   const PartialPose& placed, int step) const {
  std::vector<double> nats(poses.size);
  std::vector<RigidTransform> batch;
  for (size_t begin = 0; begin < poses.size; begin += kBatch) {
    batch.resize(std::min(poses.size - begin, kBatch));
    ParallelEach(batch.size(), [&](size_t c) { batch[c] = poses.at(begin + c); });
    const std::vector<Candidate> glances = Measured(bone, batch, placed, step);
    std::ranges::transform(glances, nats.begin() + std::ptrdiff_t(begin), &Candidate::nats);
  }
  std::vector<uint32_t> order(nats.size());
  std::iota(order.begin(), order.end(), 0u);
  std::nth_element(order.begin(), order.begin() + std::ptrdiff_t(count), order.end(),
                   [&](uint32_t a, uint32_t b) { return nats[a] != nats[b] ? nats[a] > nats[b] : a < b; });
  order.resize(count);
  std::sort(order.begin(), order.end());
  std::vector<RigidTransform> looks(count);
  ParallelEach(count, [&](size_t c) { looks[c] = poses.at(order[c]); });
  return looks;
}

std::vector<Candidate> BoneSearch::Score(int bone, const PoseList& poses, const PartialPose& placed) const {
  const int step = int(sought_.FirstSamplesOf(bone).points.size() / kGlance);
  const size_t count = std::clamp(poses.size / kLooksPart, kLooks, kMostLooks);
  if (step >= 2 && poses.size > count)
    return Measured(bone, WorthALook(bone, poses, count, placed, step), placed, 1);
  std::vector<RigidTransform> all(poses.size);
  ParallelEach(all.size(), [&](size_t c) { all[c] = poses.at(c); });
  return Measured(bone, all, placed, 1);
}

std::vector<Candidate> BoneSearch::Distinct(int bone, const std::vector<Candidate>& all, size_t count) const {
  std::vector<uint32_t> order(all.size());
  std::iota(order.begin(), order.end(), 0u);
  std::ranges::stable_sort(order, [&](uint32_t a, uint32_t b) { return Better(all[a], all[b]); });
  const BoneShape& shape = anatomy().bones[bone];
  const double apart_mm = 0.25 * shape.thickness_mm;
  std::vector<Candidate> kept;
  std::vector<PoseMark> marks;
  for (const uint32_t n : order) {
    const Candidate& candidate = all[n];
    if (kept.size() == count) break;
    const PoseMark mark = MarkOf(shape, candidate.pose);
    const bool known = std::any_of(marks.begin(), marks.end(), [&](const PoseMark& m) {
      return (m - mark).squaredNorm() < apart_mm * apart_mm;
    });
    if (known) continue;
    kept.push_back(candidate);
    marks.push_back(mark);
  }
  return kept;
}

// Whoever lies near the right pose soon stands out, which the poses of a coarse lattice do not yet.
std::vector<Candidate> BoneSearch::Climbed(int bone, std::vector<Candidate> from,
                                           const PartialPose& placed) const {
  const double step_mm = StepMm(anatomy().bones[bone]);
  const double steps_mm[] = {0.5 * step_mm, 0.5 * step_mm, 0.25 * step_mm};
  return Climb(anatomy().bones[bone], std::move(from), steps_mm,
               [&](const std::vector<RigidTransform>& poses) { return Measured(bone, poses, placed, 1); });
}

std::vector<Candidate> BoneSearch::Refined(int bone, int level, const std::vector<Candidate>& from,
                                           const PartialPose& placed) const {
  std::vector<Candidate> out(from);
  ParallelFor(out.size(), [&](size_t c) {
    const BoneSamples& samples = level == sought_.FirstLevelOf(bone) ? sought_.FirstSamplesOf(bone)
                                                                     : sought_.SamplesOf(bone, level, true);
    const PoseFit fit = RefinePose(scan_levels_[level], samples, out[c].pose, 12);
    out[c].pose = fit.scan_from_template;
    out[c].correlation = fit.correlation;
    out[c].inside = fit.inside;
    out[c].nats = MatchNats(bone, out[c]) + PriorNats(bone, out[c].pose, placed);
  });
  return out;
}

std::vector<Candidate> BoneSearch::Narrowed(int bone, const std::vector<Candidate>& scored,
                                            const PartialPose& placed) const {
  const int level = sought_.FirstLevelOf(bone);
  const size_t refined = sought_.IsRoot(bone) ? kRefinedRoot : kRefined;
  std::vector<Candidate> some = Climbed(bone, Distinct(bone, scored, kClimbing), placed);
  some = Refined(bone, level, Distinct(bone, some, refined), placed);
  some = Refined(bone, std::max(0, level - 1), Distinct(bone, some, kNarrowed), placed);
  some = Distinct(bone, some, kKept);
  for (size_t c = 0; c < some.size(); ++c) {
    some[c].runner_up_nats = c > 0 ? some[0].nats : some.size() > 1 ? some[1].nats : 0;
    for (size_t other = 0; other < some.size(); ++other) {
      if (other != c) some[c].rivals.push_back(some[other].pose);
    }
  }
  return some;
}

std::vector<Candidate> BoneSearch::Find(int bone, const PartialPose& placed) const {
  const int parent = bones().bones[bone].parent;
  const BoneShape& shape = anatomy().bones[bone];
  std::vector<RigidTransform> starts;
  if (const RigidTransform* hint = HintOf(bone)) starts.push_back(*hint);
  if (const auto place = also_tried_.find(bone); place != also_tried_.end()) starts.push_back(place->second);
  if (parent == kNoParent) {
    starts.insert(starts.begin(), RigidTransform{});
    const RootCandidates everywhere(shape, scan_levels_[0].grid);
    const std::vector<RigidTransform> near = AllNear(shape, starts);
    const auto at = [&](size_t n) {
      return n < everywhere.size() ? everywhere[n] : near[n - everywhere.size()];
    };
    return Narrowed(bone, Score(bone, {everywhere.size() + near.size(), at}, placed), placed);
  }
  const auto suggested = SuggestedMotions(placed[parent], anatomy().joints[bone].neighbours, placed);
  starts.insert(starts.begin(), suggested.begin(), suggested.end());
  std::vector<RigidTransform> poses = JointCandidates(shape, anatomy().joints[bone], *placed[parent]);
  const std::vector<RigidTransform> near = AllNear(shape, starts);
  poses.insert(poses.end(), near.begin(), near.end());
  return Narrowed(bone, Score(bone, ListOf(poses), placed), placed);
}

std::vector<Candidate> BoneSearch::FindNear(int bone, const PartialPose& placed,
                                            const std::vector<RigidTransform>& starts) const {
  const std::vector<RigidTransform> poses = AllNear(anatomy().bones[bone], starts);
  if (poses.empty()) return {};
  return Narrowed(bone, Score(bone, ListOf(poses), placed), placed);
}

Candidate BoneSearch::Finest(int bone, const Candidate& candidate) const {
  Candidate out = candidate;
  for (int level = std::max(0, sought_.FirstLevelOf(bone) - 1); level >= 0; --level) {
    const PoseFit fit = RefinePose(scan_levels_[level], sought_.SamplesOf(bone, level, true), out.pose, 20);
    out.pose = fit.scan_from_template;
    out.correlation = fit.correlation;
    out.inside = fit.inside;
  }
  constexpr int kRobustRounds = 5;
  out.pose = RefinePoseRobustly(scan_levels_[0], sought_.SamplesOf(bone, 0, true), out.pose, kRobustRounds);
  const PoseFit fit = FitAt(scan_levels_[0], sought_.SamplesOf(bone, 0, true), out.pose);
  out.correlation = fit.correlation;
  out.inside = fit.inside;
  return out;
}

Candidate BoneSearch::At(int bone, const PartialPose& placed, const RigidTransform& pose) const {
  const int level = std::max(0, sought_.FirstLevelOf(bone) - 1);
  const PoseFit fit =
      FitAt(scan_levels_[level], sought_.SamplesOf(bone, level, level != sought_.FirstLevelOf(bone)), pose);
  Candidate out;
  out.pose = pose;
  out.correlation = fit.correlation;
  out.inside = fit.inside;
  out.nats = MatchNats(bone, out) + PriorNats(bone, pose, placed);
  return out;
}

}  // namespace kvx
