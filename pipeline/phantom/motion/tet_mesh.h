// The body cut into tetrahedra: cubes of one size, six tetrahedra each (Kuhn's), so a rest point is located
// in closed form.
#pragma once
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "pipeline/phantom/anatomy/signed_distance.h"

namespace kvx::phantom {

// The six orders of the axes: tetrahedron t of a cube walks from its low corner to its high corner along
// kWalks[t].
constexpr int kWalks[6][3] = {{0, 1, 2}, {0, 2, 1}, {1, 0, 2}, {1, 2, 0}, {2, 0, 1}, {2, 1, 0}};

struct TetLocation {
  int tet = -1;                     // -1: not in the mesh
  std::array<double, 4> weights{};  // barycentric, sum 1
};

struct TetMesh {
  Eigen::Vector3d origin = Eigen::Vector3d::Zero();  // low corner of cube 0, 0, 0
  double cell_mm = 1;
  Eigen::Vector3i cells = Eigen::Vector3i::Zero();  // cubes along x, y, z
  std::vector<Eigen::Vector3d> nodes;               // at rest
  std::vector<std::array<int, 4>> tets;             // nodes in the order of the walk
  std::vector<uint8_t> walks;                       // of each tetrahedron, 0..5
  std::vector<int> tet_of;                          // [cube * 6 + walk], -1 where there is none

  TetLocation Locate(const Eigen::Vector3d& rest) const;
  Eigen::Vector3d Centroid(int tet) const;  // at rest
};

// What decides whether a tetrahedron belongs to the body.
struct MeshDomain {
  Box bounds;
  std::function<double(const Eigen::Vector3d&)> distance;  // of the skin, < 0 inside
  std::function<int(const Eigen::Vector3d&)> branch;       // finger that a place belongs to; may be empty
};

// Keeps what touches the body. A tetrahedron of air between two branches is left out, so that they move apart
// freely.
TetMesh MakeTetMesh(const MeshDomain& domain, double cell_mm);

}  // namespace kvx::phantom
