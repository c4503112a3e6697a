// Seams and parts are measured once; pairs are then joined in rounds, what goes on most first.
#include "pipeline/segmentation/ct/joined_parts.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <vector>

namespace kvx {
namespace {

constexpr float kMostHu = 2000;  // metal counts as dense bone
constexpr int kDirections = 13;  // to half of a voxel's 26 neighbours

double DensityOf(float hu) { return std::clamp(hu, 0.0f, kMostHu); }

struct Seam {
  double mineral = 0;                                // HU mm2
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();  // HU mm3: mineral times where it is
};

struct Part {
  double mineral = 0, mm3 = 0, depth_mm = 0;         // mineral: HU mm3
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();  // HU mm4
  std::map<int32_t, Seam> seams;                     // with other parts, each known by its root

  void Add(const Part& other) {
    mineral += other.mineral, mm3 += other.mm3, moment += other.moment;
    depth_mm = std::max(depth_mm, other.depth_mm);
  }
  bool Solid() const { return mm3 > kLeastBoneMm3 && IsSolid(mm3, depth_mm); }
};

// Mineral over length. The length is twice the way from the part's centre to the seam: so it is of a rod cut
// at its end and of a ball touched. No part is thicker than a ball.
double MeanCrossSection(const Part& part, const Seam& seam) {
  constexpr double kOfBall = 1.2090;  // largest cross-section over volume^(2/3)
  const double half_mm = (part.moment / part.mineral - seam.moment / seam.mineral).norm();
  const double ball = kOfBall * part.mineral / std::cbrt(part.mm3);
  return half_mm > 0 ? std::min(part.mineral / (2 * half_mm), ball) : ball;
}

// How many mm2 of a surface one pair of voxels beside each other stands for, when it parts them: a surface of
// any direction parts pairs along all thirteen (Cauchy and Crofton).
struct Direction {
  Eigen::Vector3i step;
  double mm2;
};

std::vector<Direction> Directions(const Grid& grid) {
  std::vector<Direction> directions;
  for (int n = 14; n < 27; ++n) {
    const Eigen::Vector3i step(n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1);
    const double mm = step.cast<double>().cwiseProduct(grid.spacing_mm).norm();
    directions.push_back({step, 2.0 / kDirections * grid.spacing_mm.prod() / mm});
  }
  return directions;
}

class Joining {
 public:
  Joining(const Volume& scan_hu, const NeckParts& parts) : parts_(parts.depth_mm.size()), to_(parts_.size()) {
    std::iota(to_.begin(), to_.end(), 0);
    for (size_t p = 0; p < parts_.size(); ++p)
      parts_[p].depth_mm = parts.depth_mm[p] - 0.5 * scan_hu.grid.MeanSpacingMm();
    const std::vector<Direction> directions = Directions(scan_hu.grid);
    for (size_t v = 0; v < scan_hu.values.size(); ++v)
      if (parts.part.values[v] != 0) Measure(scan_hu, parts.part, v, directions);
  }

  int32_t Root(int32_t part) {
    while (to_[part] != part) part = to_[part] = to_[to_[part]];
    return part;
  }

  // The pairs as they are now, those that go on most first. Whether any were joined.
  bool Round(double least_seam) {
    struct Pair {
      int32_t a, b;
      double seam;
    };
    std::vector<Pair> pairs;
    for (int32_t a = 1; a < int32_t(parts_.size()); ++a)
      for (const auto& [b, seam] : parts_[a].seams)
        if (a < b) pairs.push_back({a, b, SeamBetween(a, b)});
    std::ranges::stable_sort(pairs, [](const Pair& x, const Pair& y) { return x.seam > y.seam; });
    bool joined = false;
    for (const Pair& pair : pairs) {
      const int32_t a = Root(pair.a), b = Root(pair.b);
      if (a == b || SeamBetween(a, b) < least_seam) continue;
      Join(a, b);
      joined = true;
    }
    return joined;
  }

 private:
  void Measure(const Volume& scan_hu, const Image<int32_t>& part, size_t v,
               const std::vector<Direction>& directions) {
    const Grid& grid = scan_hu.grid;
    const Eigen::Vector3i at = grid.Ijk(v);
    const Eigen::Vector3d at_mm = at.cast<double>().cwiseProduct(grid.spacing_mm);
    const double density = DensityOf(scan_hu.values[v]), voxel_mm3 = grid.spacing_mm.prod();
    Part& own = parts_[part.values[v]];
    own.Add({density * voxel_mm3, voxel_mm3, 0, density * voxel_mm3 * at_mm, {}});
    for (const auto& [step, mm2] : directions) {
      const Eigen::Vector3i beside = at + step;
      if (!grid.Contains(beside)) continue;
      const size_t next = grid.Index(beside.x(), beside.y(), beside.z());
      const int32_t a = part.values[v], b = part.values[next];
      if (b == 0 || a == b) continue;
      const double mineral = mm2 * std::min(density, DensityOf(scan_hu.values[next]));
      const Eigen::Vector3d middle_mm = at_mm + 0.5 * step.cast<double>().cwiseProduct(grid.spacing_mm);
      AddSeam(a, b, {mineral, mineral * middle_mm});
    }
  }

  void AddSeam(int32_t a, int32_t b, const Seam& more) {
    for (Seam* seam : {&parts_[a].seams[b], &parts_[b].seams[a]})
      seam->mineral += more.mineral, seam->moment += more.moment;
  }

  // Over the mean cross-section of the thinner of both.
  double SeamBetween(int32_t a, int32_t b) const {
    const Part &one = parts_[a], &other = parts_[b];
    const Seam& seam = one.seams.at(b);
    if (seam.mineral <= 0 || (one.Solid() && other.Solid())) return 0;
    return seam.mineral / std::min(MeanCrossSection(one, seam), MeanCrossSection(other, seam));
  }

  void Join(int32_t a, int32_t b) {
    if (parts_[a].seams.size() < parts_[b].seams.size()) std::swap(a, b);
    const std::map<int32_t, Seam> moved = std::move(parts_[b].seams);
    parts_[b].seams.clear();
    parts_[a].seams.erase(b);
    for (const auto& [c, seam] : moved) {
      if (c == a) continue;
      parts_[c].seams.erase(b);
      AddSeam(a, c, seam);
    }
    parts_[a].Add(parts_[b]);
    to_[b] = a;
  }

  std::vector<Part> parts_;
  std::vector<int32_t> to_;
};

}  // namespace

Image<int32_t> JoinedParts(const Volume& scan_hu, NeckParts parts, double least_seam) {
  Joining joining(scan_hu, parts);
  while (joining.Round(least_seam)) {
  }
  for (int32_t& part : parts.part.values) part = joining.Root(part);
  return std::move(parts.part);
}

}  // namespace kvx
