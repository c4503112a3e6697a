// Runs of voxels along i that touch are joined; what hangs together bears the number of its first run, so the
// numbering is always the same.
#include "core/voxels/components.h"

#include <algorithm>
#include <numeric>

#include "core/host/parallel.h"
#include "core/voxels/voxel_box.h"

namespace kvx {
namespace {

// A run of voxels of a mask along i; all of it is of one piece.
struct Run {
  size_t first, end;
};

// In voxel order, and where those of every line (along i) begin among them.
struct Runs {
  explicit Runs(const Mask& mask) : first_of_line(1 + LineCount(mask.grid), 0) {
    const size_t length = size_t(mask.grid.size.x()), slices = size_t(mask.grid.size.z());
    const size_t lines = size_t(mask.grid.size.y());  // of a slice
    all = ParallelCollect<Run>(slices, [&](std::vector<Run>& runs, size_t k) {
      for (size_t line = k * lines; line < (k + 1) * lines; ++line) {
        const size_t before = runs.size();
        AddLine(mask, line * length, length, runs);
        first_of_line[line + 1] = runs.size() - before;
      }
    });
    std::partial_sum(first_of_line.begin(), first_of_line.end(), first_of_line.begin());
  }
  static size_t LineCount(const Grid& grid) { return size_t(grid.size.y()) * size_t(grid.size.z()); }
  static void AddLine(const Mask& mask, size_t at, size_t length, std::vector<Run>& runs) {
    const auto begin = mask.values.begin(), end = begin + std::ptrdiff_t(at + length);
    const auto in_mask = [](uint8_t m) { return m != 0; };
    for (auto v = begin + std::ptrdiff_t(at); (v = std::find_if(v, end, in_mask)) != end;) {
      const auto first = v;
      v = std::find(v, end, 0);
      runs.push_back({size_t(first - begin), size_t(v - begin)});
    }
  }
  std::vector<Run> all;
  std::vector<size_t> first_of_line;
};

// Which runs hang together: of each piece the first run stands for all.
class Joined {
 public:
  explicit Joined(size_t runs) : parent_(runs) { std::iota(parent_.begin(), parent_.end(), 0); }
  size_t First(size_t run) {
    while (parent_[run] != run) run = parent_[run] = parent_[parent_[run]];
    return run;
  }
  void Join(size_t a, size_t b) {
    a = First(a), b = First(b);
    parent_[std::max(a, b)] = std::min(a, b);
  }

 private:
  std::vector<size_t> parent_;
};

// Two lines beside each other, the second `stride` voxels after the first.
void JoinLines(const Runs& runs, size_t line, size_t next_line, size_t stride, Joined& joined) {
  size_t a = runs.first_of_line[line], b = runs.first_of_line[next_line];
  const size_t end_a = runs.first_of_line[line + 1], end_b = runs.first_of_line[next_line + 1];
  while (a < end_a && b < end_b) {
    const Run here = runs.all[a], there = runs.all[b];
    if (here.first + stride < there.end && there.first < here.end + stride) joined.Join(a, b);
    here.end + stride < there.end ? ++a : ++b;
  }
}

Joined Join(const Runs& runs, const Grid& grid) {
  Joined joined(runs.all.size());
  const size_t rows = size_t(grid.size.y()), lines = Runs::LineCount(grid), length = size_t(grid.size.x());
  for (size_t line = 0; line < lines; ++line) {
    if (line % rows + 1 < rows) JoinLines(runs, line, line + 1, length, joined);
    if (line + rows < lines) JoinLines(runs, line, line + rows, length * rows, joined);
  }
  return joined;
}

// Which runs are of which piece, pieces in the order of their first voxels.
struct Pieces {
  explicit Pieces(const Mask& mask) : runs(mask), of_run(runs.all.size()) {
    Joined joined = Join(runs, mask.grid);
    for (size_t r = 0; r < runs.all.size(); ++r) {
      const size_t first = joined.First(r);
      if (first == r) {
        of_run[r] = int32_t(voxels.size());
        voxels.push_back(0);
      }
      of_run[r] = of_run[first];
      voxels[size_t(of_run[r])] += runs.all[r].end - runs.all[r].first;
    }
  }
  // Calls visit(first, end, piece) for the voxels of every run.
  template <class Visit>
  void ForEachRun(Visit visit) const {
    ParallelEach(of_run.size(), [&](size_t r) { visit(runs.all[r].first, runs.all[r].end, of_run[r]); });
  }
  Runs runs;
  std::vector<int32_t> of_run;
  std::vector<size_t> voxels;  // of a piece
};

Mask MaskOf(const Pieces& pieces, const Grid& grid, const std::vector<uint8_t>& chosen) {
  Mask out(grid);
  pieces.ForEachRun([&](size_t first, size_t end, int32_t piece) {
    const auto begin = out.values.begin();
    if (chosen[size_t(piece)]) std::fill(begin + std::ptrdiff_t(first), begin + std::ptrdiff_t(end), 1);
  });
  return out;
}

// Whether a run that begins at `first` and ends before `end`, along i, meets the border; not along axes of
// one voxel.
bool AtBorder(const Grid& grid, size_t first, size_t end) {
  Eigen::Vector3i low = grid.Ijk(first), high = low;
  high.x() += int(end - first) - 1;
  for (int axis = 0; axis < 3; ++axis)
    if (grid.size[axis] > 1 && (low[axis] == 0 || high[axis] == grid.size[axis] - 1)) return true;
  return false;
}

// The voxels of one border slice, in memory order.
std::vector<size_t> FaceVoxels(const Grid& grid, int axis, int slice) {
  VoxelBox face{Eigen::Vector3i::Zero(), grid.size};
  face.low[axis] = slice, face.high[axis] = slice + 1;
  std::vector<size_t> voxels;
  ForEachVoxel(face, grid, [&](const auto&, size_t, size_t v) { voxels.push_back(v); });
  return voxels;
}

Mask FillEnclosed(const Mask& mask) { return Complement(PiecesAtBorder(Complement(mask))); }

void FillFace(int axis, int slice, Mask& mask) {
  Grid face_grid = mask.grid;
  face_grid.size[axis] = 1;
  const std::vector<size_t> voxels = FaceVoxels(mask.grid, axis, slice);
  Mask face(face_grid);
  for (size_t n = 0; n < voxels.size(); ++n) face.values[n] = mask.values[voxels[n]];
  face = FillEnclosed(face);
  for (size_t n = 0; n < voxels.size(); ++n) mask.values[voxels[n]] = face.values[n];
}

}  // namespace

Mask Complement(const Mask& mask) {
  Mask out(mask.grid);
  ParallelEach(out.values.size(), [&](size_t v) { out.values[v] = !mask.values[v]; });
  return out;
}

Components LabelComponents(const Mask& mask) {
  Pieces pieces(mask);
  Components out{Image<int32_t>(mask.grid, -1), std::move(pieces.voxels)};
  pieces.ForEachRun([&](size_t first, size_t end, int32_t piece) {
    const auto begin = out.piece.values.begin();
    std::fill(begin + std::ptrdiff_t(first), begin + std::ptrdiff_t(end), piece);
  });
  return out;
}

std::vector<uint8_t> PiecesWith(const Components& pieces, const Mask& some) {
  std::vector<uint8_t> with(pieces.voxels.size(), 0);
  for (size_t v = 0; v < some.values.size(); ++v) {
    if (some.values[v] && pieces.piece.values[v] >= 0) with[pieces.piece.values[v]] = 1;
  }
  return with;
}

Mask MaskOf(const Components& pieces, const std::vector<uint8_t>& chosen) {
  Mask out(pieces.piece.grid);
  ParallelEach(out.values.size(), [&](size_t v) {
    out.values[v] = pieces.piece.values[v] >= 0 && chosen[pieces.piece.values[v]];
  });
  return out;
}

Mask PiecesAtBorder(const Mask& mask) {
  const Pieces pieces(mask);
  std::vector<uint8_t> at_border(pieces.voxels.size(), 0);
  for (size_t r = 0; r < pieces.of_run.size(); ++r) {
    const Run& run = pieces.runs.all[r];
    if (AtBorder(mask.grid, run.first, run.end)) at_border[size_t(pieces.of_run[r])] = 1;
  }
  return MaskOf(pieces, mask.grid, at_border);
}

Mask KeepLargePieces(const Mask& mask, double fraction) {
  const Pieces pieces(mask);
  if (pieces.voxels.empty()) return mask;
  const double least = fraction * double(*std::max_element(pieces.voxels.begin(), pieces.voxels.end()));
  std::vector<uint8_t> large;
  for (const size_t voxels : pieces.voxels) large.push_back(double(voxels) >= least);
  return MaskOf(pieces, mask.grid, large);
}

Mask FillHoles(const Mask& mask) {
  Mask closed = mask;
  for (int axis = 0; axis < 3; ++axis) {
    if (mask.grid.size[axis] < 2) continue;
    FillFace(axis, 0, closed);
    FillFace(axis, mask.grid.size[axis] - 1, closed);
  }
  return FillEnclosed(closed);
}

}  // namespace kvx
