// Plain loops. Every voxel of a cell is treated by the same sentence as in the kernels.
#include "kernels/reference/block_moments.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "kernels/reference/pyramid.h"

namespace kvx::reference {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d, Eigen::Vector3i;

Vector3i ToVector(const cl_int4& v) { return {v.s[0], v.s[1], v.s[2]}; }
size_t At(const Grid& grid, const Vector3i& p) { return grid.Index(p.x(), p.y(), p.z()); }

Matrix3d Linear(const BlockLevel& level, size_t v) {
  Matrix3d a;
  for (int n = 0; n < 9; ++n) a(n / 3, n % 3) = level.linear[9 * v + n];
  return a;
}

Vector3d Land(const BlockLevel& level, const std::vector<FieldVector>& field, size_t v) {
  const Vector3d base(level.base[3 * v], level.base[3 * v + 1], level.base[3 * v + 2]);
  return base + Linear(level, v) * field[v].head<3>().cast<double>();
}

// Trilinear; p in the hull of voxel centres.
Eigen::Vector4d Sample(const std::vector<FieldVector>& image, const Grid& grid, const Vector3d& p) {
  Eigen::Vector4d sum = Eigen::Vector4d::Zero();
  const Vector3i lo = p.cast<int>().cwiseMin((grid.size.array() - 2).matrix());
  for (int c = 0; c < 8; ++c) {
    const Vector3i corner(c & 1, (c >> 1) & 1, c >> 2);
    double w = 1;
    for (int a = 0; a < 3; ++a) w *= corner[a] ? p[a] - lo[a] : 1 - (p[a] - lo[a]);
    sum += w * image[At(grid, lo + corner)].cast<double>();
  }
  return sum;
}

struct Seen {
  size_t voxel;
  double weight, scan, intensity;
  Vector3d scan_slope;  // per mm of displacement
};

// What the scan shows where the voxel lands; nothing when either scan did not see it.
std::optional<Seen> See(const BlockLevel& level, const std::vector<FieldVector>& scan,
                        const std::vector<FieldVector>& field, const Vector3i& p) {
  if (!level.grid.Contains(p)) return std::nullopt;
  const size_t v = At(level.grid, p);
  const Vector3d at = Land(level, field, v);
  if (level.weight[v] <= 0 || !level.scan.grid.Contains(PointVox{at})) return std::nullopt;
  const Eigen::Vector4d s = Sample(scan, level.scan.grid, at);
  return Seen{v, level.weight[v], s[0], level.intensity[v], Linear(level, v).transpose() * s.tail<3>()};
}

template <class Visit>
void ForEachVoxel(const Vector3i& first, Visit visit) {
  for (int c = 0; c < 8; ++c) visit(Vector3i(first + Vector3i(c & 1, (c >> 1) & 1, c >> 2)));
}

Vector3d InverseCellSquared(const Grid& grid) { return (2.0 * grid.spacing_mm).cwiseAbs2().cwiseInverse(); }

bool OnBorder(const Grid& grid, const Vector3i& p) {
  return (p.array() <= 0).any() || (p.array() >= grid.size.array() - 1).any();
}

Vector3d BendingForce(const BlockLevel& level, const Curvature& curvature, const Vector3i& cell) {
  const Grid cells = Coarsened(level.grid, 2);
  if (!cells.Contains(cell) || OnBorder(cells, cell)) return Vector3d::Zero();
  Vector3d force = Vector3d::Zero();
  for (int a = 0; a < 3; ++a) {
    const Vector3i e = Vector3i::Unit(a);
    force += InverseCellSquared(level.grid)[a] * (curvature[At(cells, cell - e)] + curvature[At(cells, cell + e)] -
                                                  2 * curvature[At(cells, cell)]);
  }
  return level.bending * 8 * level.grid.spacing_mm.prod() * force;
}

using Moments = std::array<double, kMomentChannels>;

void AddSums(const Seen& seen, double* m) {
  const double w = seen.weight, t = seen.intensity, s = seen.scan;
  const double values[kSumChannels] = {w, w * t, w * s, w * t * t, w * t * s, w * s * s};
  for (int n = 0; n < kSumChannels; ++n) m[n] += values[n];
}

void AddMoments(const Seen& seen, const Vector3d& j, Moments& m) {
  const double w = seen.weight;
  const double outer[6] = {j.x() * j.x(), j.x() * j.y(), j.x() * j.z(), j.y() * j.y(), j.y() * j.z(), j.z() * j.z()};
  for (int n = 0; n < 6; ++n) m[n] += w * outer[n];
  for (int a = 0; a < 3; ++a) {
    m[6 + a] += w * j[a] * seen.scan;
    m[9 + a] += w * j[a] * seen.intensity;
    m[12 + a] += w * j[a];
  }
  AddSums(seen, m.data() + 18);
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

// d(scan voxel) / d(voxel) by central differences; nothing where a neighbour has no map.
std::optional<Matrix3d> MapSlope(const BlockLevel& level, const std::vector<FieldVector>& field, const Vector3i& p) {
  Matrix3d slope;
  for (int a = 0; a < 3; ++a) {
    const size_t lo = At(level.grid, p - Vector3i::Unit(a)), hi = At(level.grid, p + Vector3i::Unit(a));
    if (level.weight[lo] <= 0 || level.weight[hi] <= 0) return std::nullopt;
    slope.col(a) = 0.5 * (Land(level, field, hi) - Land(level, field, lo));
  }
  const double volume = slope.col(0).norm() * slope.col(1).norm() * slope.col(2).norm();
  if (volume <= 0 || std::abs(slope.determinant()) < 0.3 * volume) return std::nullopt;
  return slope;
}

}  // namespace

Slopes TemplateSlope(const BlockLevel& level, const std::vector<FieldVector>& field) {
  Slopes out(field.size(), Vector3d::Zero());
  for (size_t v = 0; v < out.size(); ++v) {
    const Vector3i p = level.grid.Ijk(v);
    if (OnBorder(level.grid, p) || level.weight[v] <= 0) continue;
    Vector3d g;
    for (int a = 0; a < 3; ++a) {
      g[a] = 0.5 * (level.intensity[At(level.grid, p + Vector3i::Unit(a))] -
                    level.intensity[At(level.grid, p - Vector3i::Unit(a))]);
    }
    const std::optional<Matrix3d> slope = MapSlope(level, field, p);
    out[v] = slope ? Vector3d(Linear(level, v).transpose() * slope->inverse().transpose() * g)
                   : Vector3d(level.grid.VoxFromMm().transpose() * g);
  }
  return out;
}

Curvature CellCurvature(const BlockLevel& level, const std::vector<FieldVector>& field) {
  const Grid cells = Coarsened(level.grid, 2);
  Curvature out(cells.VoxelCount(), Vector3d::Zero());
  for (size_t c = 0; c < out.size(); ++c) {
    const Vector3i p = cells.Ijk(c);
    if (OnBorder(cells, p)) continue;
    for (int a = 0; a < 3; ++a) {
      const Vector3i e = 2 * Vector3i::Unit(a);
      const FieldVector bend = field[At(level.grid, 2 * p - e)] + field[At(level.grid, 2 * p + e)] -
                               2 * field[At(level.grid, 2 * p)];
      out[c] += level.stiffness[c] * InverseCellSquared(level.grid)[a] * bend.head<3>().cast<double>();
    }
  }
  return out;
}

std::vector<double> Equations(const BlockLevel& level, const BallBasis& ball, const std::vector<FieldVector>& field,
                              const Slopes& slopes, const Curvature& curvature, const Vector3i& support) {
  const std::vector<FieldVector> scan = ValueAndSlope(level.scan);
  std::vector<double> out(kEquationValues);
  for (size_t c = 0; c < ball.cells.size(); ++c) {
    const Vector3i first = support + 2 * ToVector(ball.cells[c]);
    Moments moments{};
    ForEachVoxel(first, [&](const Vector3i& p) {
      const std::optional<Seen> seen = See(level, scan, field, p);
      if (!seen) return;
      const double mobility = level.mobility[seen->voxel];
      AddMoments(*seen, 0.5 * mobility * (seen->scan_slope + slopes[seen->voxel]), moments);
    });
    if (level.grid.Contains(first)) {
      const Vector3d force = level.mobility[At(level.grid, first)] * BendingForce(level, curvature, first / 2);
      for (int a = 0; a < 3; ++a) moments[15 + a] = force[a];
    }
    Reduce(moments, ball.cell_basis[c], out);
  }
  return out;
}

std::array<double, kSumChannels> Sums(const BlockLevel& level, const BallBasis& ball, const std::vector<FieldVector>& field,
                                      const Vector3i& support) {
  const std::vector<FieldVector> scan = ValueAndSlope(level.scan);
  std::array<double, kSumChannels> out{};
  for (const cl_int4& cell : ball.cells) {
    ForEachVoxel(support + 2 * ToVector(cell), [&](const Vector3i& p) {
      if (const std::optional<Seen> seen = See(level, scan, field, p)) AddSums(*seen, out.data());
    });
  }
  return out;
}

std::vector<FieldVector> Stepped(const BlockLevel& level, const BallBasis& ball, const std::vector<FieldVector>& field,
                                 const Vector3i& support, const std::vector<float>& step) {
  std::vector<FieldVector> out = field;
  const Vector3d top = (level.grid.size.array() - 1).cast<double>().matrix();
  for (size_t n = 0; n < ball.voxels.size(); ++n) {
    const Vector3i p = support + ToVector(ball.voxels[n]);
    if (!level.grid.Contains(p)) continue;
    Vector3d u = Vector3d::Zero();
    for (int a = 0; a < kControlPoints; ++a) {
      for (int c = 0; c < 3; ++c) u[c] += double(ball.voxel_basis[n][a]) * step[8 * c + a];
    }
    u *= level.mobility[At(level.grid, p)];
    const Vector3d at = (p.cast<double>() + level.grid.VoxFromMm() * u).cwiseMax(0.0).cwiseMin(top);
    Eigen::Vector4d moved = Sample(field, level.grid, at);
    moved.head<3>() += u;
    out[At(level.grid, p)] = moved.cast<float>();
  }
  return out;
}

}  // namespace kvx::reference
