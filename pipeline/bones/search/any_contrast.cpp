// Samples of similar greys form a class; a pose is good where classes are even in the scan and air lies in
// air. Each class is scored by the kernel that also serves the correlation.
#include "pipeline/bones/search/any_contrast.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pipeline/bones/images/levels.h"
#include "pipeline/bones/search/candidate_poses.h"
#include "pipeline/bones/search/correlation_ratio.h"

namespace kvx {
namespace {

constexpr size_t kClasses = 8;
constexpr int kLloydRounds = 20;
constexpr size_t kClimbing = 512, kFew = 24;
constexpr int kGlanceStep = 4;
constexpr size_t kLooks = 20000, kBatch = size_t(1) << 16;
constexpr size_t kHypotheses = 6;
constexpr size_t kManySamples = 6000, kSamples = 2000;
constexpr int kRounds = 3, kSteps = 12;  // curve and pose in turn

size_t Nearest(const std::vector<double>& middles, double grey) {
  size_t best = 0;
  for (size_t c = 1; c < middles.size(); ++c) {
    if (std::abs(middles[c] - grey) < std::abs(middles[best] - grey)) best = c;
  }
  return best;
}

// Greys that represent all with the least variance left (Lloyd), from quantiles on.
std::vector<double> ClassMiddles(const std::vector<BoneSample>& points) {
  std::vector<double> greys;
  for (const BoneSample& point : points) greys.push_back(point.w());
  if (greys.empty()) return {};
  std::sort(greys.begin(), greys.end());
  std::vector<double> middles;
  for (size_t c = 0; c < kClasses; ++c) middles.push_back(greys[(2 * c + 1) * greys.size() / (2 * kClasses)]);
  for (int round = 0; round < kLloydRounds; ++round) {
    std::vector<double> sums(middles.size(), 0), counts(middles.size(), 0);
    for (const double grey : greys) sums[Nearest(middles, grey)] += grey, counts[Nearest(middles, grey)] += 1;
    for (size_t c = 0; c < middles.size(); ++c) {
      if (counts[c] > 0) middles[c] = sums[c] / counts[c];
    }
  }
  return middles;
}

struct SampleClass {
  bool air;  // around the template's body
  std::vector<BoneSample> points;
};

// Tissue by its greys, and air.
std::vector<SampleClass> ClassesOf(const BoneSamples& samples, const Volume& air_of_template) {
  SampleClass air{true, {}};
  std::vector<BoneSample> tissue;
  for (const BoneSample& point : samples.points) {
    const PointMm x{point.head<3>().cast<double>() + samples.centre_mm};
    const bool outside = SampleTrilinear(air_of_template, air_of_template.grid.ToVox(x)) >= 0.5f;
    (outside ? air.points : tissue).push_back(point);
  }
  const std::vector<double> middles = ClassMiddles(tissue);
  std::vector<SampleClass> classes(middles.size(), SampleClass{false, {}});
  for (const BoneSample& point : tissue) classes[Nearest(middles, point.w())].points.push_back(point);
  classes.push_back(std::move(air));
  std::erase_if(classes, [](const SampleClass& some) { return some.points.empty(); });
  return classes;
}

class ClassScores {
 public:
  ClassScores(const BoneSearch& search, int bone, const SeenAir& air, Backend& backend)
      : search_(search),
        bone_(bone),
        classes_(ClassesOf(search.sought().FirstSamplesOf(bone), air.in_template)),
        air_of_scan_(backend, air.in_scan) {}

  // `correlation` is the square root of the correlation ratio.
  std::vector<Candidate> Measured(const std::vector<RigidTransform>& poses, int step) const {
    const DeviceScan& scan = search_.DeviceLevelOf(bone_);
    const std::vector<VoxFromSample> places = PlacesIn(scan.grid, poses);
    const bool same_voxels = air_of_scan_.grid == scan.grid;
    const std::vector<VoxFromSample> others =
        same_voxels ? std::vector<VoxFromSample>{} : PlacesIn(air_of_scan_.grid, poses);
    const std::vector<VoxFromSample>& places_in_air = same_voxels ? places : others;
    std::vector<CorrelationRatio> ratios(poses.size());
    double looked_at = 0;
    for (const SampleClass& some : classes_) {
      search_.ThrowIfCancelled();
      const auto sums = search_.scores()(scan, some.points, places, step);
      const auto in_air = search_.scores()(air_of_scan_, some.points, places_in_air, step);
      for (size_t c = 0; c < poses.size(); ++c) ratios[c].Add(sums[c], in_air[c], some.air);
      looked_at += double(SamplesAtStep(some.points.size(), step));
    }
    std::vector<Candidate> out(poses.size());
    for (size_t c = 0; c < poses.size(); ++c) {
      out[c].pose = poses[c];
      out[c].correlation = std::sqrt(ratios[c].Value());
      out[c].inside = ratios[c].Count() / std::max(1.0, looked_at);
      out[c].nats = RootNats(poses[c]) + EvidenceNats(out[c].correlation, out[c].inside,
                                                      search_.independent_samples()[size_t(bone_)]);
    }
    return out;
  }

 private:
  std::vector<VoxFromSample> PlacesIn(const Grid& grid, const std::vector<RigidTransform>& poses) const {
    const Eigen::Vector3d& centre_mm = search_.sought().FirstSamplesOf(bone_).centre_mm;
    std::vector<VoxFromSample> places;
    for (const RigidTransform& pose : poses) places.push_back(ToScanVoxels(grid, pose, centre_mm));
    return places;
  }

  const BoneSearch& search_;
  int bone_;
  std::vector<SampleClass> classes_;
  DeviceScan air_of_scan_;
};

// The most likely of all poses by a glance at each, best first; of equals the first.
std::vector<RigidTransform> Looked(const ClassScores& scores, const PoseList& poses) {
  std::vector<Candidate> best;
  std::vector<RigidTransform> batch;
  for (size_t begin = 0; begin < poses.size; begin += kBatch) {
    batch.clear();
    for (size_t n = begin; n < std::min(poses.size, begin + kBatch); ++n) batch.push_back(poses.at(n));
    const std::vector<Candidate> glances = scores.Measured(batch, kGlanceStep);
    best.insert(best.end(), glances.begin(), glances.end());
    std::stable_sort(best.begin(), best.end(),
                     [](const Candidate& a, const Candidate& b) { return a.nats > b.nats; });
    if (best.size() > kLooks) best.resize(kLooks);
  }
  std::vector<RigidTransform> out;
  for (const Candidate& glance : best) out.push_back(glance.pose);
  return out;
}

std::vector<Candidate> RootsInAnyContrast(const BoneSearch& search, const Volume& scan, const SeenAir& air,
                                          Backend& backend) {
  const BoneShape& shape = search.anatomy().bones[0];
  const ClassScores scores(search, 0, air, backend);
  const RootCandidates everywhere(shape, scan.grid);
  const std::vector<RigidTransform> near = LocalCandidates(shape, RigidTransform{});
  const auto at = [&](size_t n) {
    return n < everywhere.size() ? everywhere[n] : near[n - everywhere.size()];
  };
  std::vector<Candidate> some = scores.Measured(Looked(scores, {everywhere.size() + near.size(), at}), 1);
  const double step_mm = StepMm(shape);
  const double coarse[] = {0.5 * step_mm, 0.5 * step_mm, 0.25 * step_mm},
               fine[] = {0.25 * step_mm, 0.25 * step_mm, 0.12 * step_mm, 0.12 * step_mm, 0.06 * step_mm};
  const auto measure = [&](const std::vector<RigidTransform>& beside) { return scores.Measured(beside, 1); };
  some = Climb(shape, search.Distinct(0, some, kClimbing), coarse, measure);
  some = Climb(shape, search.Distinct(0, some, kFew), fine, measure);
  return search.Distinct(0, some, kHypotheses);
}

void AddPairs(const BoneSamples& samples, const Volume& scan, const RigidTransform& pose, GreyPairs& pairs) {
  const VoxFromSample place = ToScanVoxels(scan.grid, pose, samples.centre_mm);
  for (const BoneSample& sample : samples.points) {
    const PointVox p{(place.leftCols<3>() * sample.head<3>() + place.col(3)).cast<double>()};
    if (scan.grid.Contains(p)) pairs.Add(sample.w(), SampleTrilinear(scan, p));
  }
}

std::optional<ContrastMap> ContrastAt(const BoneSamples& samples, const Volume& scan,
                                      const RigidTransform& pose) {
  GreyPairs pairs;
  AddPairs(samples, scan, pose, pairs);
  return FitContrast(pairs);
}

BoneSamples Mapped(BoneSamples samples, const ContrastMap& contrast) {
  for (BoneSample& sample : samples.points) sample.w() = contrast(sample.w());
  return samples;
}

// A place of the root and the curve that it shows, refined in turn.
struct Hypothesis {
  std::optional<ContrastMap> contrast;
  RigidTransform pose;
  double nats = -std::numeric_limits<double>::infinity();
};
Hypothesis Refined(const BoneSearch& search, const BoneSamples& samples, const Volume& scan,
                   const RigidTransform& pose) {
  Hypothesis out{ContrastAt(samples, scan, pose), pose};
  for (int round = 0; round < kRounds; ++round) {
    const PoseFit fit =
        RefinePose(scan, out.contrast ? Mapped(samples, *out.contrast) : samples, out.pose, kSteps);
    out.pose = fit.scan_from_template;
    out.nats =
        RootNats(out.pose) + EvidenceNats(fit.correlation, fit.inside, search.independent_samples()[0]);
    out.contrast = ContrastAt(samples, scan, out.pose);
  }
  return out;
}

}  // namespace

std::optional<LearntContrast> LearnContrast(const BoneSearch& search, const Volume& template_volume,
                                            const Volume& scan, const SeenAir& air, Backend& backend) {
  const BoneSamples samples = search.sought().WideSamples(0, template_volume, kManySamples);
  const Volume scaled = Normalised(scan);
  Hypothesis best;
  for (const Candidate& root : RootsInAnyContrast(search, scan, air, backend)) {
    const Hypothesis other = Refined(search, samples, scaled, root.pose);
    if (other.nats > best.nats) best = other;
  }
  if (!best.contrast) return std::nullopt;
  return LearntContrast{std::move(*best.contrast), best.pose, best.nats};
}

std::optional<ContrastMap> ContrastOfBones(const BoneSearch& search, const BoneFits& fits,
                                           const Volume& template_volume, const Volume& scan) {
  const Volume scaled = Normalised(scan);
  GreyPairs pairs;
  for (int b = 0; b < search.bones().size(); ++b) {
    if (fits[size_t(b)].Doubtful()) continue;
    AddPairs(search.sought().WideSamples(b, template_volume, kSamples), scaled,
             fits[size_t(b)].scan_from_template, pairs);
  }
  return FitContrast(pairs);
}

}  // namespace kvx
