// The search for one bone in one scan: many poses scored on the device, the best ones refined, a few distinct
// ones kept.
#pragma once
#include <functional>
#include <map>
#include <span>
#include <string>
#include <vector>

#include "core/bone.h"
#include "core/host/progress.h"
#include "pipeline/bones/refine/refine_bone.h"
#include "pipeline/bones/search/plausibility.h"
#include "pipeline/bones/template/sought_bones.h"

namespace kvx {

struct Candidate {
  RigidTransform pose;  // scan_from_template
  double correlation = 0;
  double inside = 0;                   // part of the samples that the scan saw
  double nats = 0;                     // evidence and joint terms, without overlap
  double runner_up_nats = 0;           // of the best pose elsewhere
  std::vector<RigidTransform> rivals;  // the poses elsewhere that came nearest
  int serial = 0;                      // names this pose in caches
};

// Poses by their numbers, made when asked for.
struct PoseList {
  size_t size = 0;
  std::function<RigidTransform(size_t)> at;
};

// Each candidate goes to the best of the poses beside it while that is better, in steps of these sizes.
// `measure`: candidates of the given poses, in their order.
std::vector<Candidate> Climb(
    const BoneShape& bone, std::vector<Candidate> from, std::span<const double> steps_mm,
    const std::function<std::vector<Candidate>(const std::vector<RigidTransform>&)>& measure);

// Finest voxels of a search: those of the coarser image.
double FinestMm(const Grid& template_grid, const Grid& scan_grid);

// What all bones of one scan share. Keeps a reference to what is sought. Of `progress` it asks alone whether
// to go on: in a wide scan a bone is looked for in millions of poses.
class BoneSearch {
 public:
  BoneSearch(const SoughtBones& sought, const Volume& scan, Backend& backend,
             const std::map<std::string, RigidTransform>& hints, const Progress& progress = {});

  // The same search, which tries these places of bones (by index), too; nothing else speaks for them.
  BoneSearch TryingAlso(std::map<int, RigidTransform> places) const;
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

  const SoughtBones& sought() const { return sought_; }
  const BoneSet& bones() const { return sought_.bones(); }
  const Anatomy& anatomy() const { return sought_.anatomy(); }
  const std::vector<double>& independent_samples() const { return sought_.independent_samples(); }
  const RigidTransform* HintOf(int bone) const;  // nullptr where none was given that may be meant
  // At the level at which a bone is looked for first.
  const DeviceScan& DeviceLevelOf(int bone) const { return device_levels_[sought_.FirstLevelOf(bone)]; }
  const BoneScores& scores() const { return scores_; }
  void ThrowIfCancelled() const { progress_.ThrowIfCancelled(); }
  // The best `count` of candidates, best first, none too near a better one.
  std::vector<Candidate> Distinct(int bone, const std::vector<Candidate>& all, size_t count) const;
  double OverlapWith(int bone, const RigidTransform& pose, const PartialPose& placed,
                     std::span<const double> at_stake = {}) const {
    return OverlapNats(anatomy(), independent_samples(), bone, pose, placed, at_stake);
  }

 private:
  double MatchNats(int bone, const Candidate& candidate) const;
  double HintNats(int bone, const RigidTransform& pose) const;
  double PriorNats(int bone, const RigidTransform& pose, const PartialPose& placed) const;
  double CoarsePriorNats(int bone, const RigidTransform& pose, const PartialPose& placed) const;
  std::vector<Candidate> Measured(int bone, const std::vector<RigidTransform>& poses,
                                  const PartialPose& placed, int step) const;
  std::vector<RigidTransform> WorthALook(int bone, const PoseList& poses, size_t count,
                                         const PartialPose& placed, int step) const;
  std::vector<Candidate> Score(int bone, const PoseList& poses, const PartialPose& placed) const;
  std::vector<Candidate> Climbed(int bone, std::vector<Candidate> from, const PartialPose& placed) const;
  std::vector<Candidate> Refined(int bone, int level, const std::vector<Candidate>& from,
                                 const PartialPose& placed) const;
  std::vector<Candidate> Narrowed(int bone, const std::vector<Candidate>& scored,
                                  const PartialPose& placed) const;

  const SoughtBones& sought_;
  std::vector<Volume> scan_levels_;
  std::vector<DeviceScan> device_levels_;
  std::map<int, RigidTransform> hints_, also_tried_;
  BoneScores scores_;
  Progress progress_;
  bool weak_matches_count_ = false;
};

}  // namespace kvx
