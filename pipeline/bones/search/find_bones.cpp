// Beam search, refinement at the scan's own voxels, a second look at what was lost, and the doubts.
#include "pipeline/bones/search/find_bones.h"

#include <algorithm>

#include "core/host/parallel.h"
#include "pipeline/bones/judge/doubt_bone.h"
#include "pipeline/bones/search/lost_bones.h"
#include "pipeline/bones/search/twin_poses.h"

namespace kvx {
namespace {

constexpr double kOverlapPart = 0.10;

// Why a bone's pose may be wrong; empty when nothing speaks against it.
std::string WhyDoubtful(const BoneSearch& search, int b, const std::vector<Candidate>& found) {
  const Candidate& candidate = found[b];
  if (candidate.correlation < kWeakCorrelation) return "the bone matches the scan only weakly";
  if (HasRival(candidate)) return "the bone fits another place nearly as well";
  if (WorstOverlap(search.anatomy(), b, candidate.pose, Placed(found)) > kOverlapPart) {
    return "the bone overlaps another bone";
  }
  const int parent = search.bones().bones[b].parent;
  if (parent == kNoParent) return {};
  const BoneShape& shape = search.anatomy().bones[b];
  const JointShape& joint = search.anatomy().joints[b];
  const JointState state = JointStateOf(shape, joint, found[parent].pose, candidate.pose);
  const double gap_mm = GapChangeMm(shape, search.anatomy().bones[parent], joint,
                                    found[parent].pose.Inverse() * candidate.pose);
  if (JointNats(state, shape) + GapNats(gap_mm, shape, search.anatomy().voxel_mm) < -12) {
    return "the bone lies unusually to '" + search.bones().bones[parent].name + "'";
  }
  return {};
}

// Of a bone that is put where its parent in the search's tree takes it. From a parent that was not found
// itself nobody knows whether the scan shows the bone.
std::string NoteOfUnseen(const BoneSearch& search, int b, const std::vector<Candidate>& found) {
  const int parent = search.bones().bones[b].parent;
  if (parent == kNoParent)
    return "the scan hardly shows the bone; where it lies is a guess; give an initial pose for it";
  const Candidate& beside = found[parent];
  const bool known = beside.inside >= kSeenPart && beside.correlation >= kWeakCorrelation;
  const std::string name = "'" + search.bones().bones[parent].name + "'";
  return (known && found[b].inside < kSeenPart ? "the scan hardly shows the bone"
                                               : "the bone was not found from " + name) +
         "; it is taken to move with " + name + "; give an initial pose for it if that is wrong";
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
  if (unseen && search.HintOf(b)) {
    fit.scan_from_template = *search.HintOf(b);
    fit.doubt = Doubt::kBone;
    fit.note = "the scan hardly shows the bone; it lies where its initial pose has it";
    return fit;
  }
  if (unseen) {
    fit.scan_from_template = follows.pose;
    fit.doubt = Doubt::kBone;
    fit.note = NoteOfUnseen(search, b, found);
    return fit;
  }
  if (const std::string why = WhyDoubtful(search, b, found); !why.empty()) DoubtBone(fit, why);
  return fit;
}

}  // namespace

FoundBones FindBones(const BoneSearch& search, Effort effort, const Progress& progress) {
  const BoneSet& bones = search.bones();
  std::vector<Candidate> found = FindAllBones(search, effort, progress).bones;
  if (found.empty()) return {};
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
    if (out.fits.back().Doubtful()) continue;
    sure += double(bones.bones[b].voxels);
    out.sure_correlation += double(bones.bones[b].voxels) * found[b].correlation;
    out.sure_nats += EvidenceNats(found[b].correlation, found[b].inside, search.independent_samples()[b]);
  }
  out.sure_part = sure / std::max(1.0, all);
  out.sure_correlation /= std::max(1.0, sure);
  return out;
}

}  // namespace kvx
