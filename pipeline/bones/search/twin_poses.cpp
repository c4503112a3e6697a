// Every bone by itself, parents first; the others stay where they are meanwhile.
#include "pipeline/bones/search/twin_poses.h"

#include <array>
#include <limits>
#include <optional>

#include "core/parallel.h"

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
  }

  void Compare(Candidate& own) const {
    const Bone& bone = search_.bones().bones[size_t(bone_)];
    const double rough = Tempered(search_.At(bone_, others_, own.pose)), nats = Nats(own);
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
    Candidate best = own;
    double best_nats = -std::numeric_limits<double>::infinity();
    for (const std::optional<Candidate>& twin : twins) {
      if (!twin) continue;
      if (const double twin_nats = Nats(*twin); twin_nats > best_nats) best = *twin, best_nats = twin_nats;
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
};

}  // namespace

void CompareTwins(const BoneSearch& search, std::vector<Candidate>& found) {
  for (int b = 0; b < search.bones().size(); ++b) Twins(search, found, b).Compare(found[size_t(b)]);
}

}  // namespace kvx
