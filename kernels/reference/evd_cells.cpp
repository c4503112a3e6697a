// Bricks fitted with dense linear algebra and checked node by node; unit cells one by one.
#include <algorithm>
#include <cmath>
#include <optional>

#include "core/voxels/to_corner.h"
#include "kernels/reference/evd.h"

namespace kvx::reference {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d, Eigen::Vector3i;
constexpr double kSmooth = 0.08, kSmoothAir = 0.16;  // template voxels: body, air around it
constexpr double kContraction = 0.5, kSettled = 0.004, kLeastRatio = 0.08, kMostRatio = 5;
constexpr double kMinRatio = 0.001, kMaxRatio = 20;  // of unit cells
constexpr double kMaxStretch = 4, kTorn = 1.5;

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
    c.grown = Grown(brick, at, edge), c.volume_ratio = volume_ratio;
    c.all_body = Count(brick, at, edge, true) == (edge + 1) * (edge + 1) * (edge + 1);
    return c;
  }
  void SetMap(Cell& c) const;  // and the box of the corners
  std::optional<Cell> FitBrick(int brick) const;
  std::optional<Cell> FitUnit(const Cell& started) const;
  Vector3d Miss(const Cell& c, const Vector3i& offset) const;  // of the inverse at a node, of the cell's edge
  bool SettleErrors(
      Cell& c) const;  // moves the cell to the middle of the body's; false where they are too great
  double Stretch(const Vector3i& base) const;
  bool TakeTetrahedra(const Cell& whole);
  void TakeUnit(int brick, const Vector3i& at);
  void TakeBrick(int brick);
};

void Cutting::SetMap(Cell& c) const {
  c.lowest.setConstant(INFINITY), c.highest.setConstant(-INFINITY);
  for (int n = 0; n < 8; ++n) {
    const Vector3d p = Node(c.base + c.edge * ToCorner(n));
    const Vector3d sign = (2 * ToCorner(n)).cast<double>() - Vector3d::Ones();
    c.lowest = c.lowest.cwiseMin(p), c.highest = c.highest.cwiseMax(p);
    c.map.col(0) += p / 8, c.map.middleCols<3>(1) += p * sign.transpose() / 4;
    for (int a = 0; a < 3; ++a) c.map.col(4 + a) += 0.5 * sign[(a + 1) % 3] * sign[(a + 2) % 3] * p;
    c.map.col(7) += sign.prod() * p;
  }
}

std::optional<Cell> Cutting::FitBrick(int brick) const {
  Cell c = Start(brick, Vector3i::Zero(), 4);
  SetMap(c);
  Matrix3d slope = c.map.middleCols<3>(1);
  c.terms.rightCols<4>() = c.map.rightCols<4>();
  const Vector3i centre = c.base + Vector3i::Constant(2);
  c.middle = Node(centre);
  for (int a = 0; a < 3; ++a) {
    const Vector3d low = Node(centre - 2 * Vector3i::Unit(a)), high = Node(centre + 2 * Vector3i::Unit(a));
    c.terms.col(a) = 2 * (low + high - 2 * c.middle);
    slope.col(a) = 0.5 * (slope.col(a) + high - low);
  }
  const double ratio = slope.determinant() * volume_ratio / 64;
  if (!(ratio > kLeastRatio && ratio < kMostRatio)) return {};
  c.inverse = slope.inverse();
  c.terms = c.inverse * c.terms;
  const Eigen::Matrix<double, 3, 7> size = c.terms.cwiseAbs();
  const double steepest = (size.leftCols<6>().rowwise().sum() + 0.75 * size.col(6)).maxCoeff();
  if (!(steepest < kContraction)) return {};
  double left = 4 * (0.25 * size.leftCols<6>().rowwise().sum() + 0.125 * size.col(6)).maxCoeff();
  for (; left > kSettled && c.steps < 8; left *= steepest) ++c.steps;
  return c;
}

std::optional<Cell> Cutting::FitUnit(const Cell& started) const {
  Cell c = started;
  for (int n = 0; n < 8; ++n) {  // keeps its hand at every corner
    Matrix3d at;
    for (int a = 0; a < 3; ++a)
      at.col(a) = Node(c.base + ToCorner(n | (1 << a))) - Node(c.base + ToCorner(n & ~(1 << a)));
    if (!(at.determinant() * volume_ratio > kMinRatio)) return {};
  }
  const Matrix3d slope = c.map.middleCols<3>(1);
  const double ratio = slope.determinant() * volume_ratio;
  if (!(ratio > kMinRatio && ratio < kMaxRatio)) return {};
  c.inverse = slope.inverse(), c.middle = c.map.col(0);
  return c;
}

Vector3d Cutting::Miss(const Cell& c, const Vector3i& offset) const {
  const Vector3d h = offset.cast<double>() / c.edge - Vector3d::Constant(0.5);
  return h + c.terms * TermsAt(h) - c.inverse * (Node(c.base + offset) - c.middle);
}

bool Cutting::SettleErrors(Cell& c) const {
  Vector3d least = Vector3d::Constant(INFINITY), most = -least, least_all = least, most_all = most;
  for (int n = 0; n < 125; ++n) {
    const Vector3i offset(n % 5, n / 5 % 5, n / 25);
    const Vector3d miss = Miss(c, offset);
    if (body.IsBody(c.brick, offset)) least = least.cwiseMin(miss), most = most.cwiseMax(miss);
    if (body.IsCarried(c.brick, offset))
      least_all = least_all.cwiseMin(miss), most_all = most_all.cwiseMax(miss);
  }
  const double limit = kSmooth / 4, limit_all = kSmoothAir / 4;
  Vector3d off = Vector3d::Zero();
  if (least.x() <= most.x()) off = (0.5 * (least + most)).cwiseMax(-limit).cwiseMin(limit);
  c.middle -= c.inverse.inverse() * off;
  const Vector3d in_body = (most - off).cwiseMax(off - least),
                 in_all = (most_all - off).cwiseMax(off - least_all);
  return in_body.maxCoeff() < limit && in_all.maxCoeff() < limit_all;
}

double Cutting::Stretch(const Vector3i& base) const {
  double most = 0;
  for (int n = 0; n < 8; ++n) {
    for (int a = 0; a < 3; ++a) {
      if (ToCorner(n)[a]) continue;
      const Vector3d edge = Node(base + ToCorner(n) + Vector3i::Unit(a)) - Node(base + ToCorner(n));
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
  Cell c = Start(brick, at, 1);
  SetMap(c);
  const bool cut = (body.cuts[brick][0] >> BrickedBody::Slot(at)) & 1;
  if ((!c.all_body || cut) && Stretch(c.base) > (c.all_body ? kTorn : kMaxStretch)) return;
  if (const auto fitted = FitUnit(c))
    out.cells.push_back(*fitted);
  else if (Count(brick, at, 1, true) > 0)
    out.folded += TakeTetrahedra(c) && c.all_body;
}

void Cutting::TakeBrick(int brick) {
  if (auto whole = FitBrick(brick); whole && SettleErrors(*whole)) {
    out.cells.push_back(*whole);
    return;
  }
  for (int n = 0; n < BrickedBody::kNodes; ++n) TakeUnit(brick, BrickedBody::Offset(n));
}

}  // namespace

Cells EvdCells(const BrickedBody& body, const Places& posed, const Grid& from, const Grid& to) {
  Cutting cutting{body, posed, from, to, to.MmFromVox().determinant() / from.MmFromVox().determinant()};
  for (int brick = 0; brick < body.cell_bricks; ++brick) cutting.TakeBrick(brick);
  return std::move(cutting.out);
}

}  // namespace kvx::reference
