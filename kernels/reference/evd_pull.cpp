// Every cell asks every voxel in its box.
#include <algorithm>
#include <cmath>
#include <optional>

#include "kernels/reference/evd.h"

namespace kvx::reference {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d, Eigen::Vector3i;
constexpr double kFoldedReach = 1;   // half-edges from a tetrahedron
constexpr double kMinRatio = 0.001;  // of volumes

// Of the trilinear map of a unit cell at h.
Matrix3d SlopeAt(const Cell& c, const Vector3d& h) {
  const double x = h.x(), y = h.y(), z = h.z();
  const Vector3d yz = c.map.col(4), zx = c.map.col(5), xy = c.map.col(6), xyz = c.map.col(7);
  Matrix3d slope = c.map.middleCols<3>(1);
  slope.col(0) += z * zx + y * xy + y * z * xyz;
  slope.col(1) += z * yz + x * xy + z * x * xyz;
  slope.col(2) += y * yz + x * zx + x * y * xyz;
  return slope;
}

// From h to where the trilinear map of a unit cell meets p; NaN where it does not settle.
Vector3d ByNewton(const Cell& c, const Vector3d& p, Vector3d h) {
  for (int step = 0; step < 6; ++step) {
    const double x = h.x(), y = h.y(), z = h.z();
    const Vector3d at =
        c.map * (Eigen::Vector<double, 8>() << 1, x, y, z, y * z, z * x, x * y, x * y * z).finished();
    const Vector3d move = SlopeAt(c, h).inverse() * (p - at);
    h += move;
    if (!(h.cwiseAbs().maxCoeff() <= 2)) break;
    if (move.cwiseAbs().maxCoeff() <= 0.03) return h;
  }
  return Vector3d::Constant(NAN);
}

Vector3d InverseAt(const Cell& c, const Vector3d& p) {
  const Vector3d q = c.inverse * (p - c.middle);
  if (c.tetrahedron >= 0) return q;
  if (c.edge == 1) return ByNewton(c, p, q.cwiseMax(-0.5).cwiseMin(0.5));
  Vector3d h = q;
  for (int step = 0; step < c.steps; ++step) h = q - c.terms * TermsAt(h);
  return h;
}

// How far out of the cell, so that 0.5 is its surface.
double Depth(const Cell& c, const Vector3d& h) {
  if (c.tetrahedron < 0) return h.cwiseAbs().maxCoeff();
  const int* path = kPaths[c.tetrahedron];
  const double x = h[path[0]], y = h[path[1]], z = h[path[2]];
  return std::max({x, -z, 0.5 + y - x, 0.5 + z - y});
}

int ClaimAt(const BrickedBody& body, const Cell& c, bool in_core, bool inverted, const Vector3d& place) {
  int claim = in_core ? kInnerBody : kGrown;
  const Vector3i node =
      (place.array().rint().cast<int>().matrix() - body.FirstNode(c.brick)).cwiseMax(0).cwiseMin(4);
  if (!body.IsBody(c.brick, node)) {
    if (inverted || !body.IsCarried(c.brick, node)) return kUnclaimed;
    claim = std::max(claim, kMargin);
  } else if (!body.IsInner(c.brick, node)) {
    claim = std::max(claim, kRim);
  } else if (claim == kInnerBody && body.IsBone(c.brick, node)) {
    claim = kBone;
  }
  return inverted ? kInverted : claim;
}

bool KeepsHand(const Cell& c, const Vector3d& h) {
  return SlopeAt(c, h).determinant() * c.volume_ratio > kMinRatio;
}

// Whether a voxel lies in the tetrahedron's box, widened as far as folded cells are asked.
bool IsBeside(const Cell& c, const Vector3d& voxel) {
  const Vector3d pad =
      (kFoldedReach - 0.5) * c.inverse.inverse().cwiseAbs().rowwise().sum() + Vector3d::Constant(1e-3);
  return (voxel.array() >= (c.lowest - pad).array()).all() &&
         (voxel.array() <= (c.highest + pad).array()).all();
}

// Where a folded cell's own map, its hand kept, has a voxel beside one of the cell's tetrahedra: looked for
// from the tetrahedron's place and from the cell's middle.
std::optional<Vector3d> BesideTetrahedron(const Cell& c, double reach, const Vector3d& voxel,
                                          const Vector3d& h) {
  if (!IsBeside(c, voxel)) return {};
  for (const Vector3d& start : {h, Vector3d(Vector3d::Zero())}) {
    const Vector3d found = ByNewton(c, voxel, start);
    if (found.cwiseAbs().maxCoeff() <= reach && KeepsHand(c, found)) return found;
  }
  return {};
}

// What the cell makes of a posed voxel. Of a tetrahedron of a folded cell, the cell's own map knows better
// where it has the voxel; and what lies between tetrahedra and the cells beside is that map's alone.
Landing LandingAt(const BrickedBody& body, const Cell& c, double core, double reach, const Vector3d& voxel) {
  Vector3d h = InverseAt(c, voxel);
  double depth = Depth(c, h);
  if (!(h.allFinite() && depth <= (c.tetrahedron < 0 ? reach : kFoldedReach))) return {};
  const bool held = depth <= reach;
  if (!held) {
    const auto found = BesideTetrahedron(c, reach, voxel, h);
    if (!found) return {};
    h = *found, depth = h.cwiseAbs().maxCoeff();
  } else if (c.tetrahedron >= 0) {
    const Vector3d better = ByNewton(c, voxel, h);
    if (better.cwiseAbs().maxCoeff() <= reach) h = better;
  }
  const Vector3d place = c.base.cast<double>() + Vector3d::Constant(0.5 * c.edge) + c.edge * h;
  const int claim = ClaimAt(body, c, depth <= core, c.inverted && held, place);
  return claim == kUnclaimed ? Landing{} : Landing{place, claim};
}

void ClaimVoxels(const BrickedBody& body, const Cell& c, const Grid& grid, std::vector<Landing>& out) {
  const double core = 0.5 + (c.edge > 1 ? 0.1 : 0.02) / c.edge, reach = c.grown ? 0.5 + 0.5 / c.edge : core;
  const Vector3d pad = Vector3d::Constant(0.5 + c.edge) +
                       (reach - 0.5) * c.inverse.inverse().cwiseAbs().rowwise().sum();  // more than enough
  const Vector3i first = (c.lowest - pad).array().ceil().max(0).cast<int>();
  const Vector3i last =
      (c.highest + pad).array().floor().min((grid.size.array() - 1).cast<double>()).cast<int>();
  for (int z = first.z(); z <= last.z(); ++z) {
    for (int y = first.y(); y <= last.y(); ++y) {
      for (int x = first.x(); x <= last.x(); ++x) {
        const Landing found = LandingAt(body, c, core, reach, Vector3d(x, y, z));
        Landing& landing = out[grid.Index(x, y, z)];
        if (found.claim < landing.claim) landing = found;
      }
    }
  }
}

}  // namespace

std::vector<Landing> EvdPull(const BrickedBody& body, const Cells& cells, const PoseVector& pose,
                             const Grid& template_grid, const Grid& grid) {
  std::vector<Landing> out(grid.VoxelCount());
  for (const Cell& c : cells.cells) ClaimVoxels(body, c, grid, out);
  SettleBorders(body, pose, template_grid, grid, out);
  return out;
}

}  // namespace kvx::reference
