// Plain-loop twins of evd_added.cl, evd_reach.cl, evd_forward.cl, evd_cells.cl, evd_pull.cl and evd_mend.cl,
// in double.
#pragma once
#include <span>

#include "core/blend.h"
#include "core/image.h"
#include "kernels/added_displacement.h"
#include "kernels/bricked_body.h"

namespace kvx::reference {

// Posed places of the stored nodes, in voxels of the posed grid: [brick * 64 + slot].
using Places = std::vector<Eigen::Vector3d>;

// What is added to the examples' displacements, template voxels: [brick * 64 + slot]; nothing in bones.
std::vector<Eigen::Vector3d> EvdAdded(const BrickedBody& body, const AddedDisplacement& added,
                                      const LabelMap& bone_labels);

// Eq. 6 at every stored node. `added`: as EvdAdded gives it, or nothing.
Places EvdForward(const BrickedBody& body, const Grid& template_grid, const Grid& posed_grid,
                  const PoseVector& pose, const Eigen::MatrixXf& coefficients,
                  std::span<const Eigen::Vector3d> added = {});

// Per brick with cells: whether the box of its nodes may come within `margin` voxels of the posed grid, or
// within `cut_margin` where parts may draw apart.
std::vector<uint8_t> EvdReach(const BrickedBody& body, const Grid& template_grid, const Grid& posed_grid,
                              const PoseVector& pose, const Eigen::MatrixXf& coefficients, double margin,
                              double cut_margin, std::span<const Eigen::Vector3d> added = {});

// A smooth brick, a unit cell of another, or a tetrahedron of that, and the inverse of the forward map in it:
// a brick is inverted by steps, a unit cell by Newton's method.
struct Cell {
  int brick = 0;
  Eigen::Vector3i base = Eigen::Vector3i::Zero();  // lowest node
  int edge = 4, tetrahedron = -1, steps = 0;
  bool grown = false, inverted = false, all_body = false;
  double volume_ratio = 1;                                // of a posed voxel to one of the template
  Eigen::Matrix3d inverse = Eigen::Matrix3d::Identity();  // h = inverse (p - middle) - n(h), h = -0.5 .. 0.5
  Eigen::Vector3d middle = Eigen::Vector3d::Zero();
  Eigen::Matrix<double, 3, 7> terms = Eigen::Matrix<double, 3, 7>::Zero();  // n of a brick, by TermsAt(h)
  // The trilinear map of a unit cell, of a tetrahedron the one of its cell: of 1, x, y, z, yz, zx, xy, xyz
  Eigen::Matrix<double, 3, 8> map = Eigen::Matrix<double, 3, 8>::Zero();
  Eigen::Vector3d lowest = Eigen::Vector3d::Zero(), highest = Eigen::Vector3d::Zero();  // posed corners
};

// What n of a brick is linear in.
inline Eigen::Vector<double, 7> TermsAt(const Eigen::Vector3d& h) {
  const double x = h.x(), y = h.y(), z = h.z();
  return (Eigen::Vector<double, 7>() << x * x, y * y, z * z, y * z, z * x, x * y, x * y * z).finished();
}
// The tetrahedra of a unit cell go from its lowest corner to its highest along these axes in turn.
inline constexpr int kPaths[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};

struct Cells {
  std::vector<Cell> cells;  // in the order of bricks
  int64_t folded = 0;       // unit cells of body turned inside out
};
Cells EvdCells(const BrickedBody& body, const Places& posed, const Grid& template_grid,
               const Grid& posed_grid);

// What lands on every voxel of the posed grid:
// a template place in voxels, and what claims the voxel (kUnclaimed: nothing).
constexpr int kBone = 0, kInnerBody = 1, kRim = 2, kMargin = 3, kGrown = 4, kInverted = 5,
              kUnclaimed = 6;  // see evd_bricks.cl.h
struct Landing {
  Eigen::Vector3d place = Eigen::Vector3d::Constant(NAN);
  int claim = kUnclaimed;
};
std::vector<Landing> EvdPull(const BrickedBody& body, const Cells& cells, const PoseVector& pose,
                             const Grid& template_grid, const Grid& posed_grid);
// The last of it: between bone and other tissue, what the bone's own motion decides.
void SettleBorders(const BrickedBody& body, const PoseVector& pose, const Grid& template_grid,
                   const Grid& posed_grid, std::vector<Landing>& landings);

// What is mended of them: what is not inner tissue but lies between such along two axes becomes like it;
// tissue without a neighbour becomes air, unless it lies at the grid's border or the grid is coarse.
enum class Mending : uint8_t { kNone, kFill, kClear };
std::vector<Mending> EvdMending(const std::vector<Landing>& landings, const Grid& posed_grid,
                                const Grid& template_grid);

// The template's intensities at those places, trilinear, mended; `air` where nothing lands.
Volume EvdIntensities(const std::vector<Landing>& landings, const Grid& posed_grid, const Volume& image,
                      float air);
// The template's labels there, mended: of each its share, trilinear, beside its level
// (posing/label_levels.h).
LabelMap EvdLabels(const std::vector<Landing>& landings, const Grid& posed_grid, const LabelMap& labels,
                   const std::vector<float>& levels);

}  // namespace kvx::reference
