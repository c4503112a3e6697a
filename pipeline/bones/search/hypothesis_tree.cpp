// Beam search over the bone tree and a second look.
#include "pipeline/bones/search/hypothesis_tree.h"

#include <algorithm>
#include <map>

#include "pipeline/bones/search/candidate_poses.h"
#include "pipeline/bones/search/lost_bones.h"

namespace kvx {
namespace {

constexpr size_t kBeam = 5;
constexpr double kCloseNats = 2.5;    // a rival is behind by less
constexpr double kHopelessNats = 12;  // a candidate so far behind the best one is not carried along

// A search is promising if so much of the voxels placed so far belongs to bones that are sure, ...
constexpr double kPromisingPart = 0.25;
constexpr double kPlacedPart = 0.5;  // ... once so much of all voxels is placed, ...
constexpr size_t kPlacedBones = 2;   // ... and so many bones: a second one may show that the first is right

// Evidence at stake, times this: with 1, a bone out of view takes the place of one that is partly in view.
constexpr double kStake = 3;

struct State {
  PartialPose placed;
  std::vector<Candidate> found;
  double nats = 0;
};

// By bone, what a claim on its place costs at most: who claims the place of a bone that hardly matches there
// may have it.
std::vector<double> AtStake(const std::vector<Candidate>& found) {
  std::vector<double> out;
  for (const Candidate& candidate : found) out.push_back(kStake * std::max(0.0, candidate.nats));
  return out;
}

// Parents first, and of the bones whose parent is known the largest: it is found most surely and helps its
// neighbours.
std::vector<int> SearchOrder(const BoneSet& bones) {
  std::vector<int> order;
  std::vector<bool> done(bones.size(), false);
  while (int(order.size()) < bones.size()) {
    int next = -1;
    for (int b = 0; b < bones.size(); ++b) {
      const int parent = bones.bones[b].parent;
      if (done[b] || (parent != kNoParent && !done[parent])) continue;
      if (next < 0 || bones.bones[b].voxels > bones.bones[next].voxels) next = b;
    }
    done[next] = true;
    order.push_back(next);
  }
  return order;
}

class Beam {
 public:
  explicit Beam(const BoneSearch& search) : search_(search) {
    State empty;
    empty.placed.resize(search.bones().size());
    empty.found.resize(search.bones().size());
    states_.push_back(std::move(empty));
  }

  void Extend(int bone) {
    std::vector<State> next;
    std::map<int, std::vector<Candidate>> by_parent;  // states that agree on the parent share the search
    for (const State& state : states_) {
      const int parent = search_.bones().bones[bone].parent;
      const int key = parent == kNoParent ? -1 : state.found[parent].serial;
      if (!by_parent.contains(key)) by_parent[key] = Numbered(search_.Find(bone, state.placed));
      for (const Candidate& candidate : by_parent[key]) next.push_back(With(state, bone, candidate));
    }
    std::stable_sort(next.begin(), next.end(),
                     [](const State& a, const State& b) { return a.nats > b.nats; });
    const double best = next.front().nats;
    std::erase_if(next, [&](const State& s) { return s.nats < best - kHopelessNats; });
    if (next.size() > kBeam) next.resize(kBeam);
    states_ = std::move(next);
  }

  // Says no as long as too little is placed to tell. `order`: the bones placed so far.
  bool Hopeless(std::span<const int> order) const {
    double all = 0, placed = 0, sure = 0;
    for (const Bone& bone : search_.bones().bones) all += double(bone.voxels);
    for (const int b : order) {
      const double voxels = double(search_.bones().bones[b].voxels);
      placed += voxels;
      if (Sure(Best().found[b])) sure += voxels;
    }
    return order.size() >= kPlacedBones && placed >= kPlacedPart * all && sure < kPromisingPart * placed;
  }

  const State& Best() const { return states_.front(); }

 private:
  std::vector<Candidate> Numbered(std::vector<Candidate> candidates) {
    for (Candidate& candidate : candidates) candidate.serial = serial_++;
    return candidates;
  }

  State With(const State& state, int bone, const Candidate& candidate) const {
    State out = state;
    out.placed[bone] = candidate.pose;
    out.found[bone] = candidate;
    out.nats +=
        candidate.nats + search_.OverlapWith(bone, candidate.pose, state.placed, AtStake(state.found));
    return out;
  }

  const BoneSearch& search_;
  std::vector<State> states_;
  int serial_ = 0;
};

// What the whole pose gains or loses with this bone's place: its own terms and its children's joints.
double NatsInPlace(const BoneSearch& search, int bone, const PartialPose& placed,
                   std::span<const double> at_stake, const Candidate& candidate) {
  PartialPose with = placed;
  with[bone] = candidate.pose;
  double nats = candidate.nats + search.OverlapWith(bone, candidate.pose, placed, at_stake);
  for (const int child : search.bones().ChildrenOf(bone)) nats += search.At(child, with, *placed[child]).nats;
  return nats;
}

std::vector<RigidTransform> Suggestions(const BoneSearch& search, int bone, const PartialPose& placed) {
  const int parent = search.bones().bones[bone].parent;
  std::vector<int> others = search.bones().ChildrenOf(bone);
  const auto& neighbours = search.anatomy().joints[bone].neighbours;
  others.insert(others.end(), neighbours.begin(), neighbours.end());
  return SuggestedMotions(parent == kNoParent ? std::nullopt : placed[parent], others, placed);
}

}  // namespace

bool HasRival(const Candidate& candidate) { return candidate.nats - candidate.runner_up_nats < kCloseNats; }

bool Sure(const Candidate& found) { return found.correlation >= kWeakCorrelation && !HasRival(found); }

void LookAgain(const BoneSearch& search, int bone, std::vector<Candidate>& found) {
  PartialPose others = Placed(found);
  others[bone].reset();
  const Candidate left = search.At(bone, others, found[bone].pose);
  const std::vector<double> at_stake = AtStake(found);
  const double left_nats = NatsInPlace(search, bone, others, at_stake, left);
  double best = left_nats;
  constexpr double kWorthwhileNats = 0.5;
  for (const Candidate& candidate : search.FindNear(bone, others, Suggestions(search, bone, others))) {
    const double nats = NatsInPlace(search, bone, others, at_stake, candidate);
    if (nats < best + kWorthwhileNats) continue;
    best = nats;
    found[bone] = candidate;
  }
  Candidate& now = found[bone];
  if (best > left_nats && search.Distinct(bone, {now, left}, 2).size() == 2) {
    now.runner_up_nats = std::max(now.runner_up_nats, now.nats - (best - left_nats));
    now.rivals.push_back(left.pose);
  }
}

TreeFit FindAllBones(const BoneSearch& search, Effort effort, const Progress& progress) {
  Beam beam(search);
  const std::vector<int> order = SearchOrder(search.bones());
  for (size_t n = 0; n < order.size(); ++n) {
    progress.Report("register_bones", 0.8 * double(n) / double(order.size()));
    beam.Extend(order[n]);
    if (effort == Effort::kWhilePromising && beam.Hopeless(std::span(order).first(n + 1))) return {};
  }
  TreeFit fit{beam.Best().found, beam.Best().nats};
  for (const int bone : order) LookAgain(search, bone, fit.bones);
  return fit;
}

}  // namespace kvx
