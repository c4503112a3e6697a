// The search for one bone in one scan: many poses scored on the device, the best ones refined, a few distinct
// ones kept.
#pragma once
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "core/bone.h"
#include "core/scan.h"
#include "pipeline/bones/plausibility.h"
#include "pipeline/bones/refine_bone.h"

namespace kvx {

struct Candidate {
  RigidTransform pose;  // scan_from_template
  double correlation = 0;
  double inside = 0;          // part of the samples that the scan saw
  double nats = 0;            // evidence and joint terms, without overlap
  double runner_up_nats = 0;  // of the best pose elsewhere
  int serial = 0;             // names this pose in caches
};

// Each candidate goes to the best of the poses beside it while that is better, in steps of these sizes.
// `measure`: candidates of the given poses, in their order.
std::vector<Candidate> Climb(
    const BoneShape& bone, std::vector<Candidate> from, std::span<const double> steps_mm,
    const std::function<std::vector<Candidate>(const std::vector<RigidTransform>&)>& measure);

// What all bones of one scan share. Keeps references to its arguments.
class BoneSearch {
 public:
  BoneSearch(const BoneSet& bones, const Volume& template_volume, const Volume& scan, Backend& backend,
             const std::map<std::string, RigidTransform>& hints);

  // The same search for bones that are known to be in view: where they hardly match, they are not.
  BoneSearch CountingWeakMatches() const;

  // Distinct poses, best first; `placed` holds bones found before, the parent among them.
  std::vector<Candidate> Find(int bone, const PartialPose& placed) const;
  // Like Find, but only near `starts`.
  std::vector<Candidate> FindNear(int bone, const PartialPose& placed,
                                  const std::vector<RigidTransform>& starts) const;
  // Down to the scan's own voxels.
  Candidate Finest(int bone, const Candidate& candidate) const;
  // A pose as it is.
  Candidate At(int bone, const PartialPose& placed, const RigidTransform& pose) const;

  const BoneSet& bones() const { return bones_; }
  bool HasHint(int bone) const { return hints_.contains(bone); }
  const Anatomy& anatomy() const { return anatomy_; }
  const std::vector<double>& independent_samples() const { return independent_; }
  // At the level at which a bone is looked for first.
  const DeviceScan& DeviceLevelOf(int bone) const { return device_levels_[search_level_[bone]]; }
  const BoneSamples& CoarseSamplesOf(int bone) const {
    return IsRoot(bone) ? root_samples_ : SamplesOf(bone, search_level_[bone], false);
  }
  const BoneScores& scores() const { return scores_; }
  // A bone and what surrounds it, other bones too.
  BoneSamples WideSamples(int bone, const Volume& values, size_t count) const;
  // The best `count` of candidates, best first, none too near a better one.
  std::vector<Candidate> Distinct(int bone, std::vector<Candidate> all, size_t count) const;
  double OverlapWith(int bone, const RigidTransform& pose, const PartialPose& placed) const {
    return OverlapNats(anatomy_, independent_, bone, pose, placed);
  }

 private:
  bool IsRoot(int bone) const { return bones_.bones[bone].parent == kNoParent; }
  const BoneSamples& SamplesOf(int bone, int level, bool many) const {
    return samples_[bone][2 * level + many];
  }
  double MatchNats(int bone, const Candidate& candidate) const;
  double HintNats(int bone, const RigidTransform& pose) const;
  double PriorNats(int bone, const RigidTransform& pose, const PartialPose& placed) const;
  double CoarsePriorNats(int bone, const RigidTransform& pose, const PartialPose& placed) const;
  std::vector<Candidate> Measured(int bone, const std::vector<RigidTransform>& poses,
                                  const PartialPose& placed, int step) const;
  std::vector<Candidate> Score(int bone, const std::vector<RigidTransform>& poses,
                               const PartialPose& placed) const;
  std::vector<Candidate> Climbed(int bone, std::vector<Candidate> from, const PartialPose& placed) const;
  std::vector<Candidate> Refined(int bone, int level, const std::vector<Candidate>& from,
                                 const PartialPose& placed) const;
  std::vector<Candidate> Narrowed(int bone, std::vector<Candidate> scored, const PartialPose& placed) const;
  void MakeSamples(const std::vector<Volume>& template_levels);

  const BoneSet& bones_;
  Anatomy anatomy_;
  std::vector<double> level_mm_;
  std::vector<Volume> scan_levels_;
  std::vector<DeviceScan> device_levels_;
  std::vector<int> search_level_;                  // per bone
  std::vector<std::vector<BoneSamples>> samples_;  // per bone, per level: few, many
  BoneSamples root_samples_;                       // with a wide margin, at the root's search level
  std::vector<double> independent_;                // per bone
  std::map<int, RigidTransform> hints_;
  BoneScores scores_;
  bool weak_matches_count_ = false;
};

}  // namespace kvx
