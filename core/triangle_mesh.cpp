// What follows from the corners of triangles.
#include "core/triangle_mesh.h"

#include <algorithm>
#include <numeric>

namespace kvx {
namespace {

Eigen::Vector3d Corner(const TriangleMesh& mesh, const std::array<uint32_t, 3>& triangle, int corner) {
  return mesh.vertices_mm[triangle[size_t(corner)]].cast<double>();
}

// Twice the area along the normal.
Eigen::Vector3d DoubleArea(const TriangleMesh& mesh, const std::array<uint32_t, 3>& triangle) {
  const Eigen::Vector3d a = Corner(mesh, triangle, 0);
  return (Corner(mesh, triangle, 1) - a).cross(Corner(mesh, triangle, 2) - a);
}

// Per vertex, the first vertex of its piece: triangles join their corners (union by the smaller, paths
// halved).
std::vector<uint32_t> PieceOfVertex(const TriangleMesh& mesh) {
  std::vector<uint32_t> parent(mesh.vertices_mm.size());
  std::iota(parent.begin(), parent.end(), 0u);
  const auto root = [&](uint32_t vertex) {
    while (parent[vertex] != vertex) vertex = parent[vertex] = parent[parent[vertex]];
    return vertex;
  };
  for (const auto& triangle : mesh.triangles) {
    for (size_t corner = 1; corner < 3; ++corner) {
      const auto [low, high] = std::minmax({root(triangle[0]), root(triangle[corner])});
      parent[high] = low;
    }
  }
  for (uint32_t v = 0; v < parent.size(); ++v) parent[v] = root(v);
  return parent;
}

}  // namespace

std::vector<Eigen::Vector3f> VertexNormals(const TriangleMesh& mesh) {
  std::vector<Eigen::Vector3d> sums(mesh.vertices_mm.size(), Eigen::Vector3d::Zero());
  for (const auto& triangle : mesh.triangles) {
    const Eigen::Vector3d along = DoubleArea(mesh, triangle);
    for (const uint32_t vertex : triangle) sums[vertex] += along;
  }
  std::vector<Eigen::Vector3f> normals(sums.size());
  for (size_t v = 0; v < sums.size(); ++v) {
    const double length = sums[v].norm();
    normals[v] = length > 0 ? Eigen::Vector3f((sums[v] / length).cast<float>()) : Eigen::Vector3f::UnitZ();
  }
  return normals;
}

TriangleMesh Compacted(const TriangleMesh& mesh) {
  TriangleMesh out;
  std::vector<uint32_t> renamed(mesh.vertices_mm.size(), UINT32_MAX);
  for (auto triangle : mesh.triangles) {
    for (uint32_t& vertex : triangle) {
      if (renamed[vertex] == UINT32_MAX) {
        renamed[vertex] = uint32_t(out.vertices_mm.size());
        out.vertices_mm.push_back(mesh.vertices_mm[vertex]);
      }
      vertex = renamed[vertex];
    }
    out.triangles.push_back(triangle);
  }
  return out;
}

double EnclosedVolumeMm3(const TriangleMesh& mesh) {
  if (mesh.vertices_mm.empty()) return 0;
  const Eigen::Vector3d from = mesh.vertices_mm[0].cast<double>();  // near the mesh: less is cancelled
  double sum = 0;
  for (const auto& triangle : mesh.triangles)
    sum += (Corner(mesh, triangle, 0) - from).dot(DoubleArea(mesh, triangle));
  return sum / 6;
}

double AreaMm2(const TriangleMesh& mesh) {
  double sum = 0;
  for (const auto& triangle : mesh.triangles) sum += DoubleArea(mesh, triangle).norm() / 2;
  return sum;
}

std::vector<uint32_t> BrokenVertices(const TriangleMesh& mesh) {
  std::vector<std::pair<uint32_t, uint32_t>> sides;
  for (const auto& t : mesh.triangles) {
    for (size_t side = 0; side < 3; ++side) sides.emplace_back(t[side], t[(side + 1) % 3]);
  }
  std::sort(sides.begin(), sides.end());
  std::vector<uint32_t> out;
  for (size_t s = 0; s < sides.size(); ++s) {
    const auto [from, to] = sides[s];
    const bool twice = s + 1 < sides.size() && sides[s + 1] == sides[s];
    if (from != to && !twice && std::binary_search(sides.begin(), sides.end(), std::pair{to, from})) continue;
    out.insert(out.end(), {from, to});
  }
  std::sort(out.begin(), out.end());
  out.erase(std::unique(out.begin(), out.end()), out.end());
  return out;
}

bool IsClosed(const TriangleMesh& mesh) { return BrokenVertices(mesh).empty(); }

TriangleMesh LargePieces(const TriangleMesh& mesh, double fraction) {
  if (mesh.triangles.empty()) return mesh;
  const std::vector<uint32_t> piece = PieceOfVertex(mesh);
  std::vector<double> volume(mesh.vertices_mm.size(), 0);  // at the piece's first vertex
  const Eigen::Vector3d from = mesh.vertices_mm[0].cast<double>();
  for (const auto& triangle : mesh.triangles)
    volume[piece[triangle[0]]] += (Corner(mesh, triangle, 0) - from).dot(DoubleArea(mesh, triangle)) / 6;
  const double least = fraction * *std::max_element(volume.begin(), volume.end());
  TriangleMesh out{mesh.vertices_mm, {}};
  for (const auto& triangle : mesh.triangles) {
    if (volume[piece[triangle[0]]] >= least) out.triangles.push_back(triangle);
  }
  return Compacted(out);
}

}  // namespace kvx
