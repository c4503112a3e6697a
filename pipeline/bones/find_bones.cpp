// Beam search, refinement at the scan's own voxels, a second look at what was lost, and the doubts.
#include "pipeline/bones/find_bones.h"

#include <algorithm>

#include "core/parallel.h"
#include "pipeline/bones/hypothesis_tree.h"
#include "pipeline/bones/twin_poses.h"

namespace kvx {
namespace {

constexpr double kSeenPart = 0.3;  // of a bone's samples, below which the scan does not show it
constexpr double kWeakCorrelation = 0.55;
constexpr double kCloseNats = 2.5;  // another pose explains the scan nearly as well
constexpr double kOverlapPart = 0.10;

const std::string kRemedy = "; check it and give an initial pose for this bone if it is wrong";

PartialPose Placed(const std::vector<Candidate>& found) {
  PartialPose placed;
  for (const Candidate& candidate : found) placed.push_back(candidate.pose);
  return placed;
}

// Why a bone's pose may be wrong; empty when nothing speaks against it.
std::string DoubtOf(const BoneSearch& search, int b, const std::vector<Candidate>& found) {
  const Candidate& candidate = found[b];
  const std::string bone = "bone '" + search.bones().bones[b].name + "'";
  if (candidate.correlation < kWeakCorrelation) return bone + " matches the scan only weakly" + kRemedy;
  if (candidate.nats - candidate.runner_up_nats < kCloseNats)
    return bone + " fits another place nearly as well" + kRemedy;
  if (WorstOverlap(search.anatomy(), b, candidate.pose, Placed(found)) > kOverlapPart) {
    return bone + " overlaps another bone" + kRemedy;
  }
  const int parent = search.bones().bones[b].parent;
  if (parent == kNoParent) return {};
  const BoneShape& shape = search.anatomy().bones[b];
  const JointShape& joint = search.anatomy().joints[b];
  const JointState state = JointStateOf(shape, joint, found[parent].pose, candidate.pose);
  const double gap_mm = GapChangeMm(shape, search.anatomy().bones[parent], joint,
                                    found[parent].pose.Inverse() * candidate.pose);
  if (JointNats(state, shape) + GapNats(gap_mm, shape, search.anatomy().voxel_mm) < -12) {
    return bone + " lies unusually to '" + search.bones().bones[parent].name + "'" + kRemedy;
  }
  return {};
}

BoneFit FitOf(const BoneSearch& search, int b, const std::vector<Candidate>& found,
              const PartialPose& placed) {
  BoneFit fit;
  fit.scan_from_template = found[b].pose;
  fit.correlation = found[b].correlation;
  const int parent = search.bones().bones[b].parent;
  const Candidate follows = parent == kNoParent ? found[b] : search.At(b, placed, *placed[parent]);
  const bool unseen =
      found[b].inside < kSeenPart || (follows.inside < kSeenPart && found[b].correlation < kWeakCorrelation);
  if (unseen) {
    fit.scan_from_template = follows.pose;
    fit.doubtful = true;
    fit.note = "the scan hardly shows bone '" + search.bones().bones[b].name +
               "'; it is taken to move with its parent; give an initial pose for it if that is wrong";
    return fit;
  }
  fit.note = DoubtOf(search, b, found);
  fit.doubtful = !fit.note.empty();
  return fit;
}

// Total of a bone that has its place among the others.
double NatsAmong(const BoneSearch& search, int b, const PartialPose& placed, const Candidate& candidate) {
  PartialPose others = placed;
  others[b].reset();
  return search.At(b, others, candidate.pose).nats + search.OverlapWith(b, candidate.pose, others);
}

// A wrong parent may send a bone out of the view, where nothing speaks against it.
bool Lost(const Candidate& found) {
  return found.correlation < kWeakCorrelation || found.inside < kSeenPart;
}

// Bones were looked for from parents that were known roughly. Now that parents lie to a fraction of a voxel,
// whatever is lost is looked for once more, parents first: who was lost with its parent is found with it.
// Other lost bones do not stand in the way.
void FindTheLost(const BoneSearch& search, std::vector<Candidate>& found) {
  for (int b = 0; b < search.bones().size(); ++b) {
    const int parent = search.bones().bones[b].parent;
    if (parent == kNoParent || !Lost(found[b])) continue;
    const PartialPose placed = Placed(found);
    PartialPose others = placed;
    for (int other = 0; other < search.bones().size(); ++other) {
      if (other == b || (other != parent && Lost(found[other])))
        others[other].reset();
    }
    double best = NatsAmong(search, b, others, found[b]);
    Candidate better = found[b];
    for (const Candidate& candidate : search.Find(b, others)) {
      const Candidate finest = search.Finest(b, candidate);
      const double nats = NatsAmong(search, b, others, finest);
      if (nats > best) best = nats, better = finest;
    }
    found[b] = better;
  }
}

}  // namespace

FoundBones FindBones(const BoneSearch& search, const Progress& progress) {
  const BoneSet& bones = search.bones();
  std::vector<Candidate> found = FindAllBones(search, progress).bones;
  progress.Report("register_bones", 0.9);
  ParallelFor(found.size(), [&](size_t b) { found[b] = search.Finest(int(b), found[b]); });
  FindTheLost(search, found);
  CompareTwins(search, found);
  PartialPose placed = Placed(found);
  FoundBones out;
  double sure = 0, all = 0;
  for (int b = 0; b < bones.size(); ++b) {
    out.fits.push_back(FitOf(search, b, found, placed));
    placed[b] = found[b].pose = out.fits.back().scan_from_template;
    all += double(bones.bones[b].voxels);
    if (out.fits.back().doubtful) continue;
    sure += double(bones.bones[b].voxels);
    out.sure_nats += EvidenceNats(found[b].correlation, found[b].inside, search.independent_samples()[b]);
  }
  out.sure_part = sure / std::max(1.0, all);
  return out;
}

}  // namespace kvx
