// Cells fitted with dense linear algebra and checked node by node.
#include <algorithm>
#include <cmath>
#include <optional>

#include "kernels/reference/evd.h"

namespace kvx::reference {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d, Eigen::Vector3i;
constexpr int kPaths[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};
constexpr double kSmooth = 0.08, kFair = 1, kBend = 0.35, kSettled = 0.004, kMinRatio = 0.001, kMaxRatio = 20;
constexpr double kMaxStretch = 4, kTorn = 1.5;

Eigen::Vector<double, 7> Terms(const Vector3d& h) {
  const double x = h.x(), y = h.y(), z = h.z();
  return (Eigen::Vector<double, 7>() << x * x, y * y, z * z, y * z, z * x, x * y, x * y * z).finished();
}

Vector3i Corner(int n) { return {n & 1, (n >> 1) & 1, n >> 2}; }

struct Cutting {
  const BrickedBody& body;
  const Places& posed;
  const Grid &from, &to;
  double volume_ratio;
  Cells out = {};

  Vector3d Node(const Vector3i& n) const {
    return posed[size_t(body.BrickOf(n)) * BrickedBody::kNodes + BrickedBody::Slot(n)];
  }
  int Count(int brick, const Vector3i& at, int edge, bool of_body) const {
    int sum = 0;
    for (int n = 0; n < (edge + 1) * (edge + 1) * (edge + 1); ++n) {
      const Vector3i o =
          at + Vector3i(n % (edge + 1), n / (edge + 1) % (edge + 1), n / (edge + 1) / (edge + 1));
      sum += of_body ? body.IsBody(brick, o) : body.IsCarried(brick, o);
    }
    return sum;
  }
  bool Grown(int brick, const Vector3i& at, int edge) const {
    for (int n = 0; n < edge * edge * edge; ++n) {
      const Vector3i o = at + Vector3i(n % edge, n / edge % edge, n / edge / edge);
      if ((body.cuts[brick][1] >> BrickedBody::Slot(o)) & 1) return true;
    }
    return false;
  }
  Cell Start(int brick, const Vector3i& at, int edge) const {
    Cell c;
    c.brick = brick, c.base = body.FirstNode(brick) + at, c.edge = edge;
    c.grown = Grown(brick, at, edge);
    c.all_body = Count(brick, at, edge, true) == (edge + 1) * (edge + 1) * (edge + 1);
    return c;
  }
  std::optional<Cell> Fit(int brick, const Vector3i& at, int edge) const;
  double Error(const Cell& c) const;  // of the inverse at the cell's carried nodes, template voxels
  double Bend(const Cell& c) const;   // of a brick's edges of one voxel, from the cell as fitted
  double Stretch(const Vector3i& base) const;
  bool TakeTetrahedra(const Cell& whole);
  void TakeUnit(int brick, const Vector3i& at);
  void TakeBrick(int brick);
};

bool StaysUpright(const Vector3d* corner, double volume_ratio) {
  for (int n = 0; n < 8; ++n) {
    Matrix3d slope;
    for (int a = 0; a < 3; ++a) slope.col(a) = corner[n | (1 << a)] - corner[n & ~(1 << a)];
    if (!(slope.determinant() * volume_ratio > kMinRatio)) return false;
  }
  return true;
}

std::optional<Cell> Cutting::Fit(int brick, const Vector3i& at, int edge) const {
  Cell c = Start(brick, at, edge);
  Vector3d corner[8], mean = Vector3d::Zero();
  Matrix3d slope = Matrix3d::Zero();
  c.lowest.setConstant(INFINITY), c.highest.setConstant(-INFINITY);
  for (int n = 0; n < 8; ++n) {
    const Vector3d p = corner[n] = Node(c.base + edge * Corner(n));
    const Vector3d sign = (2 * Corner(n)).cast<double>() - Vector3d::Ones();
    c.lowest = c.lowest.cwiseMin(p), c.highest = c.highest.cwiseMax(p);
    mean += p / 8, slope += p * sign.transpose() / 4;
    for (int a = 0; a < 3; ++a) c.terms.col(3 + a) += 0.5 * sign[(a + 1) % 3] * sign[(a + 2) % 3] * p;
    c.terms.col(6) += sign.prod() * p;
  }
  c.middle = mean;
  if (edge > 1) {
    const Vector3i centre = c.base + Vector3i::Constant(edge / 2);
    c.middle = Node(centre);
    for (int a = 0; a < 3; ++a) {
      const Vector3d low = Node(centre - edge / 2 * Vector3i::Unit(a)),
                     high = Node(centre + edge / 2 * Vector3i::Unit(a));
      c.terms.col(a) = 2 * (low + high - 2 * c.middle);
      slope.col(a) = 0.5 * (slope.col(a) + high - low);
    }
  }
  const double ratio = slope.determinant() * volume_ratio / (edge * edge * edge);
  if (!(ratio > (edge > 1 ? 0.08 : kMinRatio) && ratio < (edge > 1 ? 5 : kMaxRatio))) return {};
  c.inverse = slope.inverse();
  c.terms = c.inverse * c.terms;
  const Eigen::Matrix<double, 3, 7> size = c.terms.cwiseAbs();
  const double steepest = (size.leftCols<6>().rowwise().sum() + 0.75 * size.col(6)).maxCoeff();
  if (!(steepest < (edge > 1 ? 0.5 : 0.7))) {
    if (edge > 1 || !StaysUpright(corner, volume_ratio)) return {};
    c.by_newton = true;
    return c;
  }
  double left = edge * (0.25 * size.leftCols<6>().rowwise().sum() + 0.125 * size.col(6)).maxCoeff();
  for (; left > kSettled && c.steps < 8; left *= steepest) ++c.steps;
  return c;
}

double Cutting::Error(const Cell& c) const {
  const int side = c.edge + 1;
  double worst = 0;
  for (int n = 0; n < side * side * side; ++n) {
    const Vector3i node = c.base + Vector3i(n % side, n / side % side, n / side / side);
    if (!body.IsCarried(c.brick, node - body.FirstNode(c.brick))) continue;
    const Vector3d h = (node - c.base).cast<double>() / c.edge - Vector3d::Constant(0.5);
    const Vector3d error = h + c.terms * Terms(h) - c.inverse * (Node(node) - c.middle);
    worst = std::max(worst, error.cwiseAbs().maxCoeff() * c.edge);
  }
  return worst;
}

double Cutting::Bend(const Cell& c) const {
  double worst = 0;
  for (int n = 0; n < 125; ++n) {
    const Vector3i o(n % 5, n / 5 % 5, n / 25);
    for (int a = 0; a < 3; ++a) {
      if (o[a] == 4) continue;
      const Vector3d step = 4 * c.inverse * (Node(c.base + o + Vector3i::Unit(a)) - Node(c.base + o));
      worst = std::max(worst, (step - Vector3d::Unit(a)).cwiseAbs().maxCoeff());
    }
  }
  return worst;
}

double Cutting::Stretch(const Vector3i& base) const {
  double most = 0;
  for (int n = 0; n < 8; ++n) {
    for (int a = 0; a < 3; ++a) {
      if (Corner(n)[a]) continue;
      const Vector3d edge = Node(base + Corner(n) + Vector3i::Unit(a)) - Node(base + Corner(n));
      most = std::max(most, edge.cwiseProduct(to.spacing_mm).norm() / from.spacing_mm[a]);
    }
  }
  return most;
}

bool Cutting::TakeTetrahedra(const Cell& whole) {
  bool turned = false;
  for (int tet = 0; tet < 6; ++tet) {
    Cell c = whole;
    Vector3d corner[4] = {Node(c.base)};
    Matrix3d slope;
    Vector3i node = c.base;
    c.lowest = c.highest = corner[0];
    for (int i = 0; i < 3; ++i) {
      node[kPaths[tet][i]] += 1;
      corner[i + 1] = Node(node);
      slope.col(kPaths[tet][i]) = corner[i + 1] - corner[i];
      c.lowest = c.lowest.cwiseMin(corner[i + 1]), c.highest = c.highest.cwiseMax(corner[i + 1]);
    }
    const double ratio = slope.determinant() * volume_ratio;
    turned = turned || !(ratio > 0);
    if (!(std::abs(ratio) > kMinRatio && std::abs(ratio) < kMaxRatio)) continue;
    c.inverse = slope.inverse(), c.middle = 0.5 * (corner[0] + corner[3]);
    c.tetrahedron = tet, c.inverted = ratio < 0;
    out.cells.push_back(c);
  }
  return turned;
}

void Cutting::TakeUnit(int brick, const Vector3i& at) {
  if (!Count(brick, at, 1, false)) return;
  const Cell c = Start(brick, at, 1);
  const bool cut = (body.cuts[brick][0] >> BrickedBody::Slot(at)) & 1;
  if ((!c.all_body || cut) && Stretch(c.base) > (c.all_body ? kTorn : kMaxStretch)) return;
  if (const auto fitted = Fit(brick, at, 1))
    out.cells.push_back(*fitted);
  else if (Count(brick, at, 1, true) > 0)
    out.folded += TakeTetrahedra(c) && c.all_body;
}

void Cutting::TakeBrick(int brick) {
  if (auto whole = Fit(brick, Vector3i::Zero(), 4)) {
    const double error = Error(*whole);
    whole->refined = !(error < kSmooth);
    if (whole->refined) whole->steps = std::min(whole->steps, 1);
    if (!whole->refined || (error < kFair && Bend(*whole) < kBend)) {
      out.cells.push_back(*whole);
      return;
    }
  }
  for (int part = 0; part < 8; ++part) {
    const Vector3i at = 2 * Corner(part);
    if (!Count(brick, at, 2, false)) continue;
    if (const auto eighth = Fit(brick, at, 2); eighth && Error(*eighth) < kSmooth) {
      out.cells.push_back(*eighth);
    } else {
      for (int n = 0; n < 8; ++n) TakeUnit(brick, at + Corner(n));
    }
  }
}

}  // namespace

Cells EvdCells(const BrickedBody& body, const Places& posed, const Grid& from, const Grid& to) {
  Cutting cutting{body, posed, from, to, to.MmFromVox().determinant() / from.MmFromVox().determinant()};
  for (int brick = 0; brick < body.cell_bricks; ++brick) cutting.TakeBrick(brick);
  return std::move(cutting.out);
}

}  // namespace kvx::reference
