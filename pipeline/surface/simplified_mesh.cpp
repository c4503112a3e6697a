// Collapses edges everywhere, looks where that broke the surface, and begins again with those places kept.
#include "pipeline/surface/simplified_mesh.h"

#include <meshoptimizer.h>

#include <algorithm>

namespace kvx {
namespace {

// Rings of triangles kept around a broken place
constexpr int kRings = 3, kAttempts = 20;

using Triangles = std::vector<std::array<uint32_t, 3>>;

// Marks the triangles within so many rings of the vertices.
void KeepAround(const TriangleMesh& mesh, const std::vector<uint32_t>& middle, int rings,
                std::vector<char>& kept) {
  std::vector<char> vertices(mesh.vertices_mm.size(), 0);
  for (const uint32_t vertex : middle) vertices[vertex] = 1;
  for (int ring = 0; ring < rings; ++ring) {
    const std::vector<char> before = vertices;
    for (size_t t = 0; t < mesh.triangles.size(); ++t) {
      const auto touches = [&](uint32_t vertex) { return before[vertex] != 0; };
      if (!std::any_of(mesh.triangles[t].begin(), mesh.triangles[t].end(), touches)) continue;
      kept[t] = 1;
      for (const uint32_t vertex : mesh.triangles[t]) vertices[vertex] = 1;
    }
  }
}

// The triangles not kept, collapsed, then the kept ones. Their common border stays.
Triangles Collapsed(const TriangleMesh& mesh, const std::vector<char>& kept, double largest_error_mm) {
  static_assert(sizeof(Eigen::Vector3f) == 12 && sizeof(std::array<uint32_t, 3>) == 12);
  Triangles rest, whole;
  for (size_t t = 0; t < kept.size(); ++t) (kept[t] ? whole : rest).push_back(mesh.triangles[t]);
  if (rest.empty()) return whole;
  const float* positions = mesh.vertices_mm[0].data();
  const size_t count = mesh.vertices_mm.size();
  const float relative = float(largest_error_mm) / meshopt_simplifyScale(positions, count, 12);
  Triangles out(rest.size());
  out.resize(meshopt_simplify(out[0].data(), rest[0].data(), rest.size() * 3, positions, count, 12, 0,
                              relative, meshopt_SimplifyLockBorder, nullptr) /
             3);
  out.insert(out.end(), whole.begin(), whole.end());
  return out;
}

}  // namespace

TriangleMesh SimplifiedMesh(const TriangleMesh& closed, double largest_error_mm) {
  if (closed.triangles.empty() || largest_error_mm <= 0) return closed;
  std::vector<char> kept(closed.triangles.size(), 0);
  for (int attempt = 0; attempt < kAttempts; ++attempt) {
    const TriangleMesh fewer{closed.vertices_mm, Collapsed(closed, kept, largest_error_mm)};
    const std::vector<uint32_t> broken = BrokenVertices(fewer);
    if (broken.empty()) return Compacted(fewer);
    KeepAround(closed, broken, kRings, kept);
  }
  return closed;  // large, but right
}

}  // namespace kvx
