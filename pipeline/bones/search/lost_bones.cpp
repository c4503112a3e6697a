// Parents first; a bone is exchanged for what explains more among the others.
#include "pipeline/bones/search/lost_bones.h"

#include <algorithm>

namespace kvx {
namespace {

constexpr double kMostlySeen = 0.5;  // of a bone's samples, so that its match says whether it is there

// Total of a bone that has its place among the others.
double NatsAmong(const BoneSearch& search, int b, const PartialPose& placed, const Candidate& candidate) {
  PartialPose others = placed;
  others[b].reset();
  return search.At(b, others, candidate.pose).nats + search.OverlapWith(b, candidate.pose, others);
}

// A wrong parent may send a bone out of the view, where nothing speaks against it.
bool Lost(const Candidate& found) { return found.correlation < kWeakCorrelation || found.inside < kSeenPart; }

// Its parent, and all that are not lost.
PartialPose OthersThan(int bone, const BoneSet& bones, const std::vector<Candidate>& found) {
  PartialPose others = Placed(found);
  for (int other = 0; other < bones.size(); ++other) {
    if (other == bone || (other != bones.bones[bone].parent && Lost(found[other]))) others[other].reset();
  }
  return others;
}

Candidate FoundAgain(const BoneSearch& search, int bone, const PartialPose& others, const Candidate& now) {
  Candidate best = now;
  double best_nats = NatsAmong(search, bone, others, now);
  for (const Candidate& candidate : search.Find(bone, others)) {
    const Candidate finest = search.Finest(bone, candidate);
    const double nats = NatsAmong(search, bone, others, finest);
    if (nats > best_nats) best_nats = nats, best = finest;
  }
  return best;
}

}  // namespace

PartialPose Placed(const std::vector<Candidate>& found) {
  PartialPose placed;
  for (const Candidate& candidate : found) placed.push_back(candidate.pose);
  return placed;
}

void FindTheLost(const BoneSearch& search, std::vector<Candidate>& found) {
  if (std::ranges::none_of(found, Lost)) return;
  const BoneSearch of_the_seen = search.CountingWeakMatches();
  std::vector<bool> in_view;  // of each bone, whether scan and parents say that the scan shows it
  for (int b = 0; b < search.bones().size(); ++b) {
    const int parent = search.bones().bones[b].parent;
    const PartialPose placed = Placed(found);
    if (parent == kNoParent || !Lost(found[b])) {
      in_view.push_back(found[b].inside >= kMostlySeen);
      continue;
    }
    in_view.push_back(in_view[parent] && search.At(b, placed, *placed[parent]).inside >= kMostlySeen);
    found[b] =
        FoundAgain(in_view[b] ? of_the_seen : search, b, OthersThan(b, search.bones(), found), found[b]);
  }
}

}  // namespace kvx
