// Counts, plane by plane, the voxels that are not of a side's value.
#include "pipeline/scans/measured_box.h"

#include <algorithm>

#include "core/parallel.h"

namespace kvx {
namespace {

// Of the fullest plane, in the first that is not of one value: what is cut off. Limbs that curve away begin
// with a few hundredths.
constexpr double kCut = 0.2;

// Per plane across `axis`, how many voxels are not `value`.
std::vector<size_t> Others(const Volume& scan, int axis, float value) {
  const int planes = scan.grid.size[axis];
  std::vector<size_t> count(planes, 0);
  for (size_t v = 0; v < scan.values.size(); ++v) count[scan.grid.Ijk(v)[axis]] += scan.values[v] != value;
  return count;
}

// How many planes from the first on are filling.
int Filling(const std::vector<size_t>& others) {
  const auto begin = std::find_if(others.begin(), others.end(), [](size_t n) { return n > 0; });
  if (begin == others.end()) return 0;
  const size_t most = *std::max_element(others.begin(), others.end());
  return double(*begin) >= kCut * double(most) ? int(begin - others.begin()) : 0;
}

}  // namespace

MeasuredBox MeasuredBoxOf(const Volume& scan) {
  MeasuredBox box{Eigen::Vector3i::Zero(), scan.grid.size.array() - 1};
  for (int a = 0; a < 3; ++a) {
    std::vector<size_t> others = Others(scan, a, scan.values.front());
    const int first = Filling(others);
    if (scan.values.back() != scan.values.front()) others = Others(scan, a, scan.values.back());
    std::reverse(others.begin(), others.end());
    box.last[a] -= Filling(others);
    box.first[a] = std::min(first, box.last[a]);
  }
  return box;
}

Volume Within(const Volume& scan, const MeasuredBox& box) {
  Grid grid = scan.grid;
  grid.size = box.last - box.first + Eigen::Vector3i::Ones();
  if (grid.size == scan.grid.size) return scan;
  grid.origin = scan.grid.ToMm(PointVox{box.first.cast<double>()});
  Volume out(grid);
  ParallelRanges(out.values.size(), [&](size_t begin, size_t end) {
    for (size_t v = begin; v < end; ++v) {
      const Eigen::Vector3i p = grid.Ijk(v) + box.first;
      out.values[v] = scan(p.x(), p.y(), p.z());
    }
  });
  return out;
}

Volume Measured(const Volume& scan) { return Within(scan, MeasuredBoxOf(scan)); }

}  // namespace kvx
