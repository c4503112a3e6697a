// Parents first; a bone is exchanged for what explains more among the others.
#include "pipeline/bones/lost_bones.h"

namespace kvx {
namespace {

// Total of a bone that has its place among the others.
double NatsAmong(const BoneSearch& search, int b, const PartialPose& placed, const Candidate& candidate) {
  PartialPose others = placed;
  others[b].reset();
  return search.At(b, others, candidate.pose).nats + search.OverlapWith(b, candidate.pose, others);
}

// A wrong parent may send a bone out of the view, where nothing speaks against it.
bool Lost(const Candidate& found) { return found.correlation < kWeakCorrelation || found.inside < kSeenPart; }

}  // namespace

PartialPose Placed(const std::vector<Candidate>& found) {
  PartialPose placed;
  for (const Candidate& candidate : found) placed.push_back(candidate.pose);
  return placed;
}

void FindTheLost(const BoneSearch& search, std::vector<Candidate>& found) {
  for (int b = 0; b < search.bones().size(); ++b) {
    const int parent = search.bones().bones[b].parent;
    if (parent == kNoParent || !Lost(found[b])) continue;
    const PartialPose placed = Placed(found);
    PartialPose others = placed;
    for (int other = 0; other < search.bones().size(); ++other) {
      if (other == b || (other != parent && Lost(found[other]))) others[other].reset();
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

}  // namespace kvx
