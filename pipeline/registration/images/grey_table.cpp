// Multilevel approximation of scattered data (Lee, Wolberg, Shin 1997) with trilinear cells: each finer table
// adds what the coarser one leaves, as far as there are voxels to say it.
#include "pipeline/registration/images/grey_table.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "core/host/parallel.h"
#include "core/numbers/quantile.h"
#include "core/voxels/sample_clamped.h"
#include "core/voxels/to_corner.h"

namespace kvx {
namespace {

constexpr int kFinestNodes = 17;  // along an axis
constexpr double kTail = 0.005;   // of the template's greys beyond the first and the last node
// Of all voxels: so many speak half for themselves, half as the coarser table does
constexpr double kFew = 0.0002;

Volume TableOf(int nodes) {
  Grid grid;
  grid.size = Eigen::Vector3i::Constant(nodes);
  return Volume(grid);
}

// Darkest and brightest of a voxel and its two neighbours along an axis.
void Widen(const Grid& grid, int axis, std::vector<Eigen::Vector3f>& greys) {
  const std::vector<Eigen::Vector3f> before = greys;
  ParallelEach(greys.size(), [&](size_t v) {
    for (const int side : {-1, 1}) {
      const Eigen::Vector3i p = grid.Ijk(v) + side * Eigen::Vector3i::Unit(axis);
      if (!grid.Contains(p)) continue;
      const Eigen::Vector3f& beside = before[grid.Index(p.x(), p.y(), p.z())];
      greys[v][0] = std::min(greys[v][0], beside[0]);
      greys[v][2] = std::max(greys[v][2], beside[2]);
    }
  });
}

struct Corners {
  std::array<size_t, 8> node;
  std::array<double, 8> share;
  double squares = 0;
};
Corners CornersAt(const Grid& table, const PointVox& p) {
  const Eigen::Vector3i lo = p.ijk.array().floor().cast<int>().min(table.size.array() - 2).max(0);
  const Eigen::Vector3d t = p.ijk - lo.cast<double>();
  Corners out;
  for (int c = 0; c < 8; ++c) {
    const Eigen::Vector3i n = lo + ToCorner(c);
    out.share[size_t(c)] = 1;
    for (int a = 0; a < 3; ++a) out.share[size_t(c)] *= c >> a & 1 ? t[a] : 1 - t[a];
    out.node[size_t(c)] = table.Index(n.x(), n.y(), n.z());
    out.squares += out.share[size_t(c)] * out.share[size_t(c)];
  }
  return out;
}

}  // namespace

std::vector<Eigen::Vector3f> SurroundedGreys(const Volume& volume) {
  std::vector<Eigen::Vector3f> greys(volume.values.size(), Eigen::Vector3f::Zero());
  for (size_t v = 0; v < greys.size(); ++v) greys[v].setConstant(volume.values[v]);
  for (int axis = 0; axis < 3; ++axis) Widen(volume.grid, axis, greys);
  return greys;
}

GreyTable::GreyTable(std::span<const Eigen::Vector3f> greys, std::span<const float> shown)
    : table_(TableOf(2)) {
  std::vector<float> own;
  for (size_t v = 0; v < greys.size(); ++v)
    if (!std::isnan(shown[v])) own.push_back(greys[v][1]);
  if (own.empty()) return;
  low_ = TakeQuantile(own, kTail), high_ = TakeQuantile(own, 1 - kTail);
  const double few = kFew * double(own.size());
  AddMeans(greys, shown, few);
  while (table_.grid.size.x() < kFinestNodes) {
    Refine();
    AddMeans(greys, shown, few);
  }
}

float GreyTable::operator()(const Eigen::Vector3f& greys) const { return SampleTrilinear(table_, At(greys)); }

PointVox GreyTable::At(const Eigen::Vector3f& greys) const {
  const double last = table_.grid.size.x() - 1, range = high_ > low_ ? high_ - low_ : 1.0;
  return PointVox{((greys.array() - low_).cast<double>() / range).max(0.0).min(1.0) * last};
}

// The same function on nodes half as far apart.
void GreyTable::Refine() {
  Volume finer = TableOf(2 * table_.grid.size.x() - 1);
  for (size_t n = 0; n < finer.values.size(); ++n)
    finer.values[n] = SampleClamped(table_, PointVox{0.5 * finer.grid.Ijk(n).cast<double>()});
  table_ = std::move(finer);
}

void GreyTable::AddMeans(std::span<const Eigen::Vector3f> greys, std::span<const float> shown, double few) {
  std::vector<double> sum(table_.values.size(), 0), weight(table_.values.size(), 0);
  for (size_t v = 0; v < greys.size(); ++v) {
    if (std::isnan(shown[v])) continue;
    const double left = shown[v] - (*this)(greys[v]);
    const Corners corners = CornersAt(table_.grid, At(greys[v]));
    for (size_t c = 0; c < 8; ++c) {
      const double squared = corners.share[c] * corners.share[c];
      sum[corners.node[c]] += squared * corners.share[c] / corners.squares * left;
      weight[corners.node[c]] += squared;
    }
  }
  for (size_t n = 0; n < sum.size(); ++n) table_.values[n] += float(sum[n] / (weight[n] + few));
}

}  // namespace kvx
