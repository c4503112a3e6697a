// What follows from the corners of triangles.
#include "core/triangle_mesh.h"

#include <algorithm>

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

bool IsClosed(const TriangleMesh& mesh) {
  std::vector<std::pair<uint32_t, uint32_t>> forth, back;
  for (const auto& t : mesh.triangles) {
    for (int side = 0; side < 3; ++side) {
      const uint32_t a = t[size_t(side)], b = t[size_t(side + 1) % 3];
      if (a == b) return false;
      forth.emplace_back(a, b);
      back.emplace_back(b, a);
    }
  }
  std::sort(forth.begin(), forth.end());
  std::sort(back.begin(), back.end());
  return forth == back && std::adjacent_find(forth.begin(), forth.end()) == forth.end();
}

}  // namespace kvx
