// Cubes over the body's box; distances at their corners decide which tetrahedra stay.
#include "pipeline/phantom/motion/tet_mesh.h"

#include <algorithm>

#include "core/host/parallel.h"

namespace kvx::phantom {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

Vector3i CornersOf(const TetMesh& mesh) { return mesh.cells + Vector3i::Ones(); }

size_t CornerIndex(const Vector3i& corners, const Vector3i& c) {
  return (size_t(c.z()) * corners.y() + c.y()) * corners.x() + c.x();
}

// Signed distances at all cube corners.
std::vector<double> CornerDistances(const TetMesh& mesh, const MeshDomain& domain) {
  const Vector3i corners = CornersOf(mesh);
  std::vector<double> distances(size_t(corners.prod()));
  ParallelFor(corners.z(), [&](int k) {
    for (int j = 0; j < corners.y(); ++j) {
      for (int i = 0; i < corners.x(); ++i) {
        const Vector3i c(i, j, k);
        distances[CornerIndex(corners, c)] = domain.distance(mesh.origin + mesh.cell_mm * c.cast<double>());
      }
    }
  });
  return distances;
}

std::array<Vector3i, 4> WalkCorners(const Vector3i& cube, int walk) {
  std::array<Vector3i, 4> c = {cube, cube, cube, cube};
  for (int step = 0; step < 3; ++step) {
    for (int later = step + 1; later < 4; ++later) c[later][kWalks[walk][step]] += 1;
  }
  return c;
}

bool BridgesBranches(const TetMesh& mesh, const MeshDomain& domain, const std::array<Vector3i, 4>& corners) {
  if (!domain.branch) return false;
  const int first = domain.branch(mesh.origin + mesh.cell_mm * corners[0].cast<double>());
  return std::any_of(corners.begin() + 1, corners.end(), [&](const Vector3i& c) {
    return domain.branch(mesh.origin + mesh.cell_mm * c.cast<double>()) != first;
  });
}

// A tetrahedron stays when the skin's inside reaches it: a corner inside, or its centre within half a cube of
// the skin.
bool Stays(const TetMesh& mesh, const MeshDomain& domain, const std::array<Vector3i, 4>& corners,
           const std::vector<double>& distances) {
  double least = 1e9;
  Vector3d centre = Vector3d::Zero();
  for (const Vector3i& c : corners) {
    least = std::min(least, distances[CornerIndex(CornersOf(mesh), c)]);
    centre += 0.25 * c.cast<double>();
  }
  if (least > mesh.cell_mm) return false;
  const double at_centre = domain.distance(mesh.origin + mesh.cell_mm * centre);
  if (least > 0 && at_centre > 0.45 * mesh.cell_mm) return false;
  return at_centre <= 0 || !BridgesBranches(mesh, domain, corners);
}

TetMesh EmptyMesh(const Box& bounds, double cell_mm) {
  TetMesh mesh;
  mesh.cell_mm = cell_mm;
  mesh.origin = bounds.low.array() - 1.01 * cell_mm;
  mesh.cells = ((bounds.high - mesh.origin) / cell_mm).array().ceil().cast<int>() + 1;
  mesh.tet_of.assign(size_t(mesh.cells.prod()) * 6, -1);
  return mesh;
}

}  // namespace

TetLocation TetMesh::Locate(const Vector3d& rest) const {
  const Vector3d p = (rest - origin) / cell_mm;
  const Vector3d base = p.array().floor();
  if ((base.array() < 0).any() || (base.array() >= cells.cast<double>().array()).any()) return {};
  const Vector3d f = p - base;
  int walk = 0;  // the walk that takes the axes by falling fraction
  while (f[kWalks[walk][0]] < f[kWalks[walk][1]] || f[kWalks[walk][1]] < f[kWalks[walk][2]]) ++walk;
  const Vector3i cube = base.cast<int>();
  const size_t index = (size_t(cube.z()) * cells.y() + cube.y()) * cells.x() + cube.x();
  const double a = f[kWalks[walk][0]], b = f[kWalks[walk][1]], c = f[kWalks[walk][2]];
  return {tet_of[index * 6 + walk], {1 - a, a - b, b - c, c}};
}

Vector3d TetMesh::Centroid(int tet) const {
  const std::array<int, 4>& n = tets[tet];
  return 0.25 * (nodes[n[0]] + nodes[n[1]] + nodes[n[2]] + nodes[n[3]]);
}

TetMesh MakeTetMesh(const MeshDomain& domain, double cell_mm) {
  TetMesh mesh = EmptyMesh(domain.bounds, cell_mm);
  const std::vector<double> distances = CornerDistances(mesh, domain);
  const Vector3i corners = CornersOf(mesh);
  std::vector<int> node_of(distances.size(), -1);
  for (size_t cube = 0; cube < size_t(mesh.cells.prod()); ++cube) {
    const Vector3i at(int(cube % mesh.cells.x()), int(cube / mesh.cells.x() % mesh.cells.y()),
                      int(cube / (size_t(mesh.cells.x()) * mesh.cells.y())));
    for (int walk = 0; walk < 6; ++walk) {
      const std::array<Vector3i, 4> c = WalkCorners(at, walk);
      if (!Stays(mesh, domain, c, distances)) continue;
      std::array<int, 4> tet{};
      for (int n = 0; n < 4; ++n) {
        int& node = node_of[CornerIndex(corners, c[n])];
        if (node < 0) {
          node = int(mesh.nodes.size());
          mesh.nodes.push_back(mesh.origin + cell_mm * c[n].cast<double>());
        }
        tet[n] = node;
      }
      mesh.tet_of[cube * 6 + walk] = int(mesh.tets.size());
      mesh.tets.push_back(tet);
      mesh.walks.push_back(uint8_t(walk));
    }
  }
  return mesh;
}

}  // namespace kvx::phantom
