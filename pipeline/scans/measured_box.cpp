// Counts, plane by plane, the voxels that are not of a side's value.
#include "pipeline/scans/measured_box.h"

#include <algorithm>
#include <array>

namespace kvx {
namespace {

// Of the fullest plane, in the first that is not of one value: what is cut off. Limbs that curve away begin
// with a few hundredths.
constexpr double kCut = 0.2;

bool IsAllOf(const Volume& scan, const VoxelBox& part, float value) {
  for (int k = part.low.z(); k < part.high.z(); ++k) {
    for (int j = part.low.y(); j < part.high.y(); ++j) {
      for (int i = part.low.x(); i < part.high.x(); ++i)
        if (scan(i, j, k) != value) return false;
    }
  }
  return true;
}

// Per axis and plane across it, how many voxels are not `value`.
std::array<std::vector<size_t>, 3> Others(const Volume& scan, float value) {
  const Eigen::Vector3i& size = scan.grid.size;
  std::array<std::vector<size_t>, 3> count;
  for (int a = 0; a < 3; ++a) count[a].assign(size[a], 0);
  size_t v = 0;
  for (int k = 0; k < size.z(); ++k) {
    for (int j = 0; j < size.y(); ++j) {
      size_t in_row = 0;
      for (int i = 0; i < size.x(); ++i, ++v) {
        const bool other = scan.values[v] != value;
        count[0][i] += other, in_row += other;
      }
      count[1][j] += in_row, count[2][k] += in_row;
    }
  }
  return count;
}

// Whether the first plane across some axis is all of the value `front`, or the last of `back`.
bool HasFilledSide(const Volume& scan, float front, float back) {
  for (int a = 0; a < 3; ++a) {
    for (const bool at_back : {false, true}) {
      VoxelBox side{Eigen::Vector3i::Zero(), scan.grid.size};
      (at_back ? side.low[a] : side.high[a]) = at_back ? scan.grid.size[a] - 1 : 1;
      if (IsAllOf(scan, side, at_back ? back : front)) return true;
    }
  }
  return false;
}

// How many planes from the first on are filling.
int Filling(const std::vector<size_t>& others) {
  const auto begin = std::find_if(others.begin(), others.end(), [](size_t n) { return n > 0; });
  if (begin == others.end()) return 0;
  const size_t most = *std::max_element(others.begin(), others.end());
  return double(*begin) >= kCut * double(most) ? int(begin - others.begin()) : 0;
}

}  // namespace

VoxelBox MeasuredBoxOf(const Volume& scan) {
  const float front = scan.values.front(), back = scan.values.back();
  if (!HasFilledSide(scan, front, back)) return {Eigen::Vector3i::Zero(), scan.grid.size};
  const auto from_front = Others(scan, front);
  auto from_back = front == back ? from_front : Others(scan, back);
  VoxelBox box;
  for (int a = 0; a < 3; ++a) {
    std::reverse(from_back[a].begin(), from_back[a].end());
    box.high[a] = scan.grid.size[a] - Filling(from_back[a]);
    box.low[a] = Filling(from_front[a]);
    // Of one plane no spline can be made
    if (box.high[a] - box.low[a] < std::min(2, scan.grid.size[a]))
      box.low[a] = 0, box.high[a] = scan.grid.size[a];
  }
  return box;
}

OwnOrLent<Volume> Measured(const Volume& scan) { return Within(scan, MeasuredBoxOf(scan)); }

OwnOrLent<Scan> Measured(const Scan& scan) {
  OwnOrLent<Volume> measured = Measured(scan.volume);
  if (measured.lent()) return scan;
  return With(std::move(measured).Taken(), scan);
}

}  // namespace kvx
