// Passes along one axis of a volume, several lines at once: what is done to one is done to its neighbours by
// the same instructions.
#pragma once
#include <algorithm>
#include <array>
#include <type_traits>
#include <vector>

#include "core/host/parallel.h"
#include "core/image.h"
#include "core/voxels/grid_lines.h"

namespace kvx {

// A voxel of each of a bundle's lines.
template <class T>
using BundleRow = Eigen::Array<T, 16, 1>;

// pass(rows): gets the rows of a bundle, in the order of its lines, to change in place. Bundles that are not
// full end in empty lines. Every thread has a copy of `pass`.
template <class T, class Pass>
void ForEachLineBundle(Volume& volume, int axis, const Pass& pass_of_all) {
  constexpr size_t kLanes = BundleRow<T>::SizeAtCompileTime;
  const GridLines lines(volume.grid, axis);
  ParallelRanges((lines.count + kLanes - 1) / kLanes, [&](size_t begin, size_t end) {
    std::decay_t<Pass> pass = pass_of_all;
    std::vector<BundleRow<T>> rows(size_t(lines.length), BundleRow<T>::Zero());
    std::array<float*, kLanes> first{};
    for (size_t bundle = begin; bundle < end; ++bundle) {
      const size_t line = bundle * kLanes, lanes = std::min(kLanes, lines.count - line);
      for (size_t n = 0; n < lanes; ++n) first[n] = &volume.values[lines.First(line + n)];
      for (size_t i = 0; i < rows.size(); ++i) {
        for (size_t n = 0; n < lanes; ++n) rows[i][Eigen::Index(n)] = T(first[n][i * lines.stride]);
      }
      pass(rows);
      for (size_t i = 0; i < rows.size(); ++i) {
        for (size_t n = 0; n < lanes; ++n) first[n][i * lines.stride] = float(rows[i][Eigen::Index(n)]);
      }
    }
  });
}

}  // namespace kvx
