// Greedy: the shortest gap first, from the tip of a chain to the nearest bone that is in none.
#include "pipeline/segmentation/names/finger_chains.h"

#include <algorithm>
#include <limits>

namespace kvx {
namespace {

constexpr size_t kFingers = 5, kLongest = 4, kThumb = 3;
constexpr size_t kNobody = std::numeric_limits<size_t>::max();

// How clearly one gap is the shorter of two; a millimetre is no difference.
double Clearness(double gap_mm, double next_mm) {
  return std::clamp(1 - (gap_mm + 1) / (next_mm + 1), 0.0, 1.0);
}

class ChainFinder {
 public:
  ChainFinder(const std::vector<LabelShape>& shapes, const std::vector<std::vector<double>>& gaps)
      : shapes_(shapes), gaps_(gaps), taken_(shapes.size(), 0), tip_(shapes.size(), 0) {}

  FingerChains Find() {
    if (shapes_.size() < kFingers + 1 || !FindCarpals() || !StartAtCarpals()) return {};
    for (size_t length = 1; length < kLongest; ++length) LengthenAll();
    FindThumb();
    OrderFingers();
    return std::move(hand_);
  }

 private:
  // The block is by far the largest.
  bool FindCarpals() {
    size_t largest = 0, second = kNobody;
    for (size_t s = 1; s < shapes_.size(); ++s) {
      if (shapes_[s].voxels > shapes_[largest].voxels)
        second = largest, largest = s;
      else if (second == kNobody || shapes_[s].voxels > shapes_[second].voxels)
        second = s;
    }
    hand_.carpals = largest;
    taken_[largest] = 1;
    const double ratio = double(shapes_[largest].voxels) / double(shapes_[second].voxels);
    hand_.confidence = std::clamp(2 * (ratio - 1), 0.0, 1.0);
    return hand_.confidence > 0;
  }

  void Take(size_t shape, size_t base_end) { taken_[shape] = 1, tip_[shape] = 1 - base_end; }
  size_t NearEnd(size_t shape, size_t to) const {
    return gaps_[2 * shape][to] <= gaps_[2 * shape + 1][to] ? 0 : 1;
  }

  bool StartAtCarpals() {
    std::vector<std::pair<double, size_t>> near;
    for (size_t s = 0; s < shapes_.size(); ++s) {
      if (!taken_[s]) near.emplace_back(gaps_[2 * s + NearEnd(s, hand_.carpals)][hand_.carpals], s);
    }
    std::ranges::sort(near);
    if (near.size() < kFingers) return false;
    const double next =
        near.size() > kFingers ? near[kFingers].first : std::numeric_limits<double>::infinity();
    const double clear = 2 * Clearness(near[kFingers - 1].first, next);
    for (size_t f = 0; f < kFingers; ++f) {
      Take(near[f].second, NearEnd(near[f].second, hand_.carpals));
      hand_.fingers.push_back({{near[f].second}, {clear}});
    }
    return true;
  }

  struct Link {
    double gap = std::numeric_limits<double>::infinity();
    size_t finger = kNobody, bone = kNobody;
  };

  // From the tip of a chain, and back from the bone's nearer end: both must be close.
  double GapMm(size_t finger, size_t bone) const {
    const size_t last = hand_.fingers[finger].bones.back();
    return std::max(gaps_[2 * last + tip_[last]][bone], gaps_[2 * bone + NearEnd(bone, last)][last]);
  }

  Link Shortest(const std::vector<uint8_t>& grown, size_t but_finger, size_t but_bone) const {
    Link best;
    for (size_t f = 0; f < kFingers; ++f) {
      for (size_t b = 0; b < shapes_.size(); ++b) {
        if (taken_[b] || grown[f] || (f == but_finger && b == but_bone)) continue;
        if (but_finger != kNobody && f != but_finger && b != but_bone)
          continue;  // rivals share one of the two
        const double gap = GapMm(f, b);
        if (gap < best.gap) best = {gap, f, b};
      }
    }
    return best;
  }

  // One bone more for every chain that has one to follow.
  void LengthenAll() {
    std::vector<uint8_t> grown(kFingers, 0);
    for (size_t n = 0; n < kFingers; ++n) {
      const Link link = Shortest(grown, kNobody, kNobody);
      if (link.finger == kNobody) return;
      const size_t last = hand_.fingers[link.finger].bones.back();
      const double length_mm = (shapes_[last].ends[1].lps - shapes_[last].ends[0].lps).norm();
      const Link rival = Shortest(grown, link.finger, link.bone);
      grown[link.finger] = 1;
      if (link.gap > 0.7 * length_mm) continue;  // the finger has ended
      Take(link.bone, NearEnd(link.bone, last));
      hand_.fingers[link.finger].bones.push_back(link.bone);
      hand_.fingers[link.finger].confidence.push_back(2 * Clearness(link.gap, rival.gap));
    }
  }

  PointMm TipOf(size_t shape) const { return shapes_[shape].ends[tip_[shape]]; }

  // The one chain of three bones. Where bones are missing, it is the metacarpal that turns away most from the
  // others.
  void FindThumb() {
    const auto complete = [](const FingerChain& chain) { return chain.bones.size() == kLongest; };
    const auto whole = std::ranges::count_if(hand_.fingers, complete);
    auto thumb = std::ranges::find_if_not(hand_.fingers, complete);
    if (whole != kFingers - 1 || thumb->bones.size() != kThumb) {
      thumb = std::ranges::max_element(hand_.fingers, {},
                                       [&](const FingerChain& chain) { return TurnOf(chain); });
      hand_.confidence *= 0.4;
    }
    std::iter_swap(hand_.fingers.begin(), thumb);
  }

  Eigen::Vector3d DirectionOf(const FingerChain& chain) const {
    const LabelShape& shape = shapes_[chain.bones[0]];
    const size_t tip = tip_[chain.bones[0]];
    return (shape.ends[tip].lps - shape.ends[1 - tip].lps).normalized();
  }
  double TurnOf(const FingerChain& chain) const {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (const FingerChain& other : hand_.fingers) sum += DirectionOf(other);
    return -sum.normalized().dot(DirectionOf(chain));
  }

  // Along the line through the heads of the four metacarpals, from the thumb's side.
  void OrderFingers() {
    const auto head = [&](const FingerChain& chain) { return TipOf(chain.bones[0]).lps; };
    const auto first = hand_.fingers.begin() + 1;
    Eigen::Vector3d across = Eigen::Vector3d::Zero(), middle = Eigen::Vector3d::Zero();
    for (auto a = first; a != hand_.fingers.end(); ++a) {
      middle += head(*a) / double(kFingers - 1);
      for (auto b = first; b != hand_.fingers.end(); ++b) {
        if ((head(*a) - head(*b)).norm() > across.norm()) across = head(*a) - head(*b);
      }
    }
    if (across.dot(head(hand_.fingers[0]) - middle) > 0) across = -across;
    std::stable_sort(first, hand_.fingers.end(), [&](const FingerChain& a, const FingerChain& b) {
      return across.dot(head(a)) < across.dot(head(b));
    });
  }

  const std::vector<LabelShape>& shapes_;
  const std::vector<std::vector<double>>& gaps_;
  std::vector<uint8_t> taken_;
  std::vector<size_t> tip_;  // number of the end that is away from the carpals
  FingerChains hand_;
};

}  // namespace

FingerChains FindFingerChains(const std::vector<LabelShape>& shapes,
                              const std::vector<std::vector<double>>& gaps) {
  return ChainFinder(shapes, gaps).Find();
}

}  // namespace kvx
