// Every voxel is looked at on its own; the kernels keep sums per cell instead.
#include "kernels/reference/block_moments.h"

#include <algorithm>

#include "core/voxels/cubic_spline.h"

namespace kvx::reference {
namespace {

using Eigen::Vector3d, Eigen::Vector3i;

Vector3i ToVector(const cl_int4& v) { return {v.s[0], v.s[1], v.s[2]}; }
size_t At(const Grid& grid, const Vector3i& p) { return grid.Index(p.x(), p.y(), p.z()); }
Grid CellsOf(const BlockLevel& level) { return Coarsened(level.grid, 2); }

// Trilinear, clamped to the hull of the samples.
template <class Vector>
Eigen::VectorXd Sample(const std::vector<Vector>& image, const Grid& grid, const Vector3d& at) {
  Eigen::VectorXd sum = Eigen::VectorXd::Zero(image[0].size());
  const Vector3d p = grid.Nearest(PointVox{at}).ijk;
  const Vector3i lo = p.cast<int>().cwiseMin((grid.size.array() - 2).matrix());
  for (int c = 0; c < 8; ++c) {
    const Vector3i corner(c & 1, (c >> 1) & 1, c >> 2);
    double w = 1;
    for (int a = 0; a < 3; ++a) w *= corner[a] ? p[a] - lo[a] : 1 - (p[a] - lo[a]);
    sum += w * image[At(grid, lo + corner)].template cast<double>();
  }
  return sum;
}

template <class Visit>
void ForEachVoxel(const Vector3i& cell, Visit visit) {
  for (int c = 0; c < 8; ++c) visit(Vector3i(2 * cell + Vector3i(c & 1, (c >> 1) & 1, c >> 2)));
}

Vector3d InverseCellSquared(const Grid& grid) { return (2.0 * grid.spacing_mm).cwiseAbs2().cwiseInverse(); }

bool OnBorder(const Grid& grid, const Vector3i& p) {
  return (p.array() <= 0).any() || (p.array() >= grid.size.array() - 1).any();
}

bool IsActive(const BlockLevel& level, const Vector3i& cell) {
  const auto index = cl_int(At(CellsOf(level), cell));
  return std::binary_search(level.active.begin(), level.active.end(), index);
}

double CellMobility(const BlockLevel& level, const Vector3i& cell) {
  double sum = 0;
  ForEachVoxel(cell, [&](const Vector3i& p) { sum += level.mobility[At(level.grid, p)]; });
  return sum / 8;
}

// The field's mean over a cell, with the steps at its centre added. Beyond the active cells it counts as 0,
// though a coarser level's goes on there: read, it made the error of tissue bent from nothing 1.3 to 1.5 %
// larger.
Vector3d CellField(const BlockLevel& level, const std::vector<FieldVector>& field, const CellSteps& steps,
                   const Vector3i& cell) {
  Vector3d before = Vector3d::Zero();
  if (IsActive(level, cell)) {
    ForEachVoxel(cell,
                 [&](const Vector3i& p) { before += field[At(level.grid, p)].head<3>().cast<double>() / 8; });
  }
  return before + CellMobility(level, cell) * steps[At(CellsOf(level), cell)];
}

template <class Value>  // Value(cell) -> Vector3d
Vector3d Laplacian(const BlockLevel& level, const Vector3i& cell, Value value) {
  Vector3d sum = Vector3d::Zero();
  for (int a = 0; a < 3; ++a) {
    const Vector3i e = Vector3i::Unit(a);
    sum += InverseCellSquared(level.grid)[a] * (value(cell - e) + value(cell + e) - 2 * value(cell));
  }
  return sum;
}

Vector3d BendingForce(const BlockLevel& level, const std::vector<FieldVector>& field, const CellSteps& steps,
                      const Vector3i& cell) {
  const Grid cells = CellsOf(level);
  if (!cells.Contains(cell) || OnBorder(cells, cell)) return Vector3d::Zero();
  const auto curvature = [&](const Vector3i& c) -> Vector3d {
    if (OnBorder(cells, c) || !IsActive(level, c)) return Vector3d::Zero();
    return level.stiffness[At(cells, c)] *
           Laplacian(level, c, [&](const Vector3i& n) { return CellField(level, field, steps, n); });
  };
  return CellMobility(level, cell) * level.bending * 8 * level.grid.spacing_mm.prod() *
         Laplacian(level, cell, curvature);
}

// Mean slope of scan and template per mm, as splines through them have it for waves of four voxels. A
// neighbour that was not seen repeats the voxel itself, whose slope is the difference to the other one;
// beside such a voxel there are differences over two voxels alone.
Vector3d Slope(const BlockLevel& level, const Seen& seen, const Vector3i& p) {
  const auto was_seen = [&](const Vector3i& q) { return level.grid.Contains(q) && seen[At(level.grid, q)]; };
  const auto sum = [&](const Vector3i& q) {
    const size_t v = At(level.grid, was_seen(q) ? q : p);
    return *seen[v] + level.intensity[v];
  };
  Vector3d per_voxel;
  for (int a = 0; a < 3; ++a) {
    const Vector3i e = Vector3i::Unit(a);
    const bool ends = !was_seen(p - e) || !was_seen(p + e);
    const double near = (ends ? 0.5 : 0.25) * (sum(p + e) - sum(p - e)),
                 far = 0.125 * (sum(p + 2 * e) - sum(p - 2 * e));
    const bool whole = was_seen(p - 2 * e) && was_seen(p - e) && was_seen(p + e) && was_seen(p + 2 * e);
    per_voxel[a] = whole ? 1.5 * near - 0.5 * far : near;
  }
  return level.grid.VoxFromMm().transpose() * per_voxel;
}

using Moments = std::array<double, kMomentChannels>;

void AddMoments(double w, double s, double t, const Vector3d& j, Moments& m) {
  const double outer[6] = {j.x() * j.x(), j.x() * j.y(), j.x() * j.z(),
                           j.y() * j.y(), j.y() * j.z(), j.z() * j.z()};
  for (int n = 0; n < 6; ++n) m[n] += w * outer[n];
  for (int a = 0; a < 3; ++a) {
    m[6 + a] += w * j[a] * s;
    m[9 + a] += w * j[a] * t;
    m[12 + a] += w * j[a];
  }
  const double values[kSumChannels] = {w, w * t, w * s, w * t * t, w * t * s, w * s * s};
  for (int n = 0; n < kSumChannels; ++n) m[18 + n] += values[n];
}

void Reduce(const Moments& m, const std::array<float, kControlPoints>& phi, std::vector<double>& out) {
  for (int a = 0; a < kControlPoints; ++a) {
    for (int n = 0; n < 6; ++n) {
      for (int b = 0; b < kControlPoints; ++b) out[64 * n + 8 * a + b] += double(phi[a]) * phi[b] * m[n];
    }
    for (int n = 6; n < 18; ++n) out[384 + 8 * (n - 6) + a] += phi[a] * m[n];
  }
  for (int n = 18; n < 24; ++n) out[480 + n - 18] += m[n];
}

}  // namespace

Seen SeenThrough(const BlockLevel& level, const std::vector<FieldVector>& field) {
  Seen out(field.size());
  const Volume spline = SplineCoefficients(level.scan);
  const Grid cells = CellsOf(level);
  for (const cl_int active : level.active) {
    ForEachVoxel(cells.Ijk(size_t(active)), [&](const Vector3i& p) {
      const size_t v = At(level.grid, p);
      const Vector3d at = p.cast<double>() + level.grid.VoxFromMm() * field[v].head<3>().cast<double>();
      const PointVox landed{Sample(level.start, level.grid, at).head<3>()};
      if (level.scan.grid.Contains(landed)) out[v] = SampleSpline(spline, landed);
    });
  }
  return out;
}

void AddStep(const BlockLevel& level, const BallBasis& ball, const Vector3i& support,
             const std::vector<float>& step_mm, CellSteps& steps) {
  const Grid cells = CellsOf(level);
  for (size_t c = 0; c < ball.cells.size(); ++c) {
    const Vector3i cell = support / 2 + ToVector(ball.cells[c]);
    if (!cells.Contains(cell)) continue;
    for (int a = 0; a < kControlPoints; ++a) {
      for (int n = 0; n < 3; ++n)
        steps[At(cells, cell)][n] += double(ball.cell_basis[c][a]) * step_mm[8 * n + a];
    }
  }
}

std::vector<double> Equations(const BlockLevel& level, const BallBasis& ball,
                              const std::vector<FieldVector>& field, const Seen& seen, const CellSteps& steps,
                              const Vector3i& support, std::span<const float> targets) {
  const Grid cells = CellsOf(level);
  std::vector<double> out(kEquationValues);
  for (size_t c = 0; c < ball.cells.size(); ++c) {
    const Vector3i cell = support / 2 + ToVector(ball.cells[c]);
    if (!cells.Contains(cell)) continue;
    Moments moments{};
    ForEachVoxel(cell, [&](const Vector3i& p) {
      const size_t v = At(level.grid, p);
      if (!seen[v] || level.weight[v] <= 0) return;
      const Vector3d j = level.mobility[v] * Slope(level, seen, p);
      AddMoments(level.weight[v], *seen[v] + j.dot(steps[At(cells, cell)]),
                 targets.empty() ? level.intensity[v] : targets[v], j, moments);
    });
    const Vector3d force = BendingForce(level, field, steps, cell);
    for (int a = 0; a < 3; ++a) moments[15 + a] = force[a];
    Reduce(moments, ball.cell_basis[c], out);
  }
  return out;
}

std::array<double, kSumChannels> Sums(const BlockLevel& level, const BallBasis& ball, const Seen& seen,
                                      const Vector3i& support) {
  Moments moments{};
  for (const cl_int4& cell : ball.cells) {
    ForEachVoxel(support / 2 + ToVector(cell), [&](const Vector3i& p) {
      if (!level.grid.Contains(p)) return;
      const size_t v = At(level.grid, p);
      if (seen[v] && level.weight[v] > 0)
        AddMoments(level.weight[v], *seen[v], level.intensity[v], Vector3d::Zero(), moments);
    });
  }
  std::array<double, kSumChannels> out;
  std::copy_n(moments.begin() + 18, kSumChannels, out.begin());
  return out;
}

std::vector<FieldVector> Composed(const BlockLevel& level, const std::vector<FieldVector>& field,
                                  const CellSteps& steps) {
  std::vector<FieldVector> out = field;
  const Grid cells = CellsOf(level);
  for (const cl_int active : level.active) {
    ForEachVoxel(cells.Ijk(size_t(active)), [&](const Vector3i& p) {
      const size_t v = At(level.grid, p);
      const Vector3d in_cells = 0.5 * p.cast<double>() - Vector3d::Constant(0.25);
      const Vector3d u = level.mobility[v] * Vector3d(Sample(steps, cells, in_cells));
      const Eigen::VectorXd moved = Sample(field, level.grid, p.cast<double>() + level.grid.VoxFromMm() * u);
      out[v].head<3>() = (u + moved.head<3>()).cast<float>();
    });
  }
  return out;
}

}  // namespace kvx::reference
