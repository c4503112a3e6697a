// Every bone by itself, parents first; the others stay where they are meanwhile.
#include "pipeline/bones/search/twin_poses.h"

#include <array>
#include <limits>
#include <optional>

#include "core/host/parallel.h"
#include "pipeline/bones/search/hypothesis_tree.h"

namespace kvx {
namespace {

constexpr double kClearNats = 2.5;      // as much better as makes a twin the likely one
constexpr double kHopelessNats = 60.0;  // so far behind before refinement, no twin catches up
constexpr double kBestMatch = 0.99;     // interpolation leaves as much open: nobody is nearer to its template

class Twins {
 public:
  Twins(const BoneSearch& search, const std::vector<Candidate>& found, int bone)
      : search_(search), bone_(bone) {
    for (const Candidate& candidate : found) placed_.push_back(candidate.pose);
    others_ = placed_;
    others_[bone].reset();
    const int parent = search.bones().bones[size_t(bone)].parent;
    beside_a_sure_parent_ = parent != kNoParent && Sure(found[size_t(parent)]);
  }

  void Compare(Candidate& own) const {
    std::vector<Candidate> elsewhere = HalfTurned(own);
    if (HasRival(own) && !own.rivals.empty() && beside_a_sure_parent_) {
      const std::vector<Candidate> rivals = Rivals(own);
      elsewhere.insert(elsewhere.end(), rivals.begin(), rivals.end());
      own.runner_up_nats = -kNone;
    }
    const double nats = Nats(own);
    Candidate best = own;
    double best_nats = -kNone;
    for (const Candidate& other : elsewhere) {
      if (const double other_nats = Nats(other); other_nats > best_nats) best = other, best_nats = other_nats;
    }
    const double lead = std::abs(nats - best_nats);
    if (best_nats > nats + kClearNats) {
      best.runner_up_nats = best.nats - lead;
      own = best;
    } else {
      own.runner_up_nats = std::max(own.runner_up_nats, own.nats - lead);
    }
  }

 private:
  static constexpr double kNone = std::numeric_limits<double>::infinity();

  std::vector<Candidate> HalfTurned(const Candidate& own) const {
    const Bone& bone = search_.bones().bones[size_t(bone_)];
    const double rough = Tempered(search_.At(bone_, others_, own.pose));
    std::array<std::optional<Candidate>, 3> twins;
    ParallelFor(twins.size(), [&](size_t axis) {
      const RigidTransform half_turn =
          RotationAbout(bone.centroid, bone.box.axes.col(Eigen::Index(axis)), kPi);
      const Candidate start = search_.At(bone_, others_, own.pose * half_turn);
      if (Tempered(start) < rough - kHopelessNats) return;
      const Candidate twin = search_.Finest(bone_, start);
      const bool came_back = (own.pose.Inverse() * twin.pose).AngleRad() < kPi / 4;
      if (!came_back) twins[axis] = twin;
    });
    std::vector<Candidate> out;
    for (const std::optional<Candidate>& twin : twins) {
      if (twin) out.push_back(*twin);
    }
    return out;
  }

  // Where they come to lie at the scan's voxels; nothing of one that comes to where the bone is.
  std::vector<Candidate> Rivals(const Candidate& own) const {
    std::vector<Candidate> rivals(own.rivals.size());
    ParallelFor(rivals.size(), [&](size_t n) {
      rivals[n] = search_.Finest(bone_, search_.At(bone_, others_, own.rivals[n]));
    });
    std::erase_if(rivals, [&](const Candidate& rival) {
      return search_.Distinct(bone_, {own, rival}, 2).size() < 2;
    });
    return rivals;
  }

  // Evidence at the scan's voxels, and how the bone suits its parent, neighbours and children there.
  double Nats(const Candidate& candidate) const {
    const Candidate at = search_.At(bone_, others_, candidate.pose);
    // That limbs seldom turn far between scans does not make a root's twin unlikely enough.
    const bool unbound = search_.bones().bones[size_t(bone_)].parent == kNoParent && !search_.HintOf(bone_);
    const double prior = unbound ? 0.0 : at.nats - Evidence(at, 1);
    double nats =
        prior + Evidence(candidate, kBestMatch) + search_.OverlapWith(bone_, candidate.pose, others_);
    PartialPose with = placed_;
    with[size_t(bone_)] = candidate.pose;
    for (const int child : search_.bones().ChildrenOf(bone_))
      nats += search_.At(child, with, *placed_[size_t(child)]).nats;
    return nats;
  }

  double Evidence(const Candidate& c, double best_match) const {
    return EvidenceNats(best_match * c.correlation, c.inside, search_.independent_samples()[size_t(bone_)]);
  }
  // Its nats, had no pose matched better than the best that can be told apart.
  double Tempered(const Candidate& at) const { return at.nats - Evidence(at, 1) + Evidence(at, kBestMatch); }

  const BoneSearch& search_;
  int bone_;
  PartialPose placed_, others_;
  // Elsewhere a bone may be where no rival is.
  bool beside_a_sure_parent_;
};

}  // namespace

void CompareTwins(const BoneSearch& search, std::vector<Candidate>& found) {
  for (int b = 0; b < search.bones().size(); ++b) Twins(search, found, b).Compare(found[size_t(b)]);
}

}  // namespace kvx
