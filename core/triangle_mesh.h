// Triangle meshes in millimetres.
#pragma once
#include <array>
#include <string>
#include <vector>

#include "core/frames.h"

namespace kvx {

// Seen from outside, a triangle's corners run counter-clockwise.
struct TriangleMesh {
  std::vector<Eigen::Vector3f> vertices_mm;  // LPS
  std::vector<std::array<uint32_t, 3>> triangles;
};

// Of every vertex, unit length: the mean of its triangles' normals, weighted by area.
std::vector<Eigen::Vector3f> VertexNormals(const TriangleMesh& mesh);

// Without the vertices that no triangle uses.
TriangleMesh Compacted(const TriangleMesh& mesh);

// Positive for a closed mesh whose normals point outwards.
double EnclosedVolumeMm3(const TriangleMesh& mesh);
double AreaMm2(const TriangleMesh& mesh);

// The ends of edges that do not belong to exactly two triangles, which run along them in opposite directions;
// sorted.
std::vector<uint32_t> BrokenVertices(const TriangleMesh& mesh);

// No vertex is broken.
bool IsClosed(const TriangleMesh& mesh);

// Of a closed mesh, the connected pieces that enclose at least `fraction` of the volume that the largest one
// encloses. Cavities, which enclose a negative one, go. Vertices that no triangle uses are dropped.
TriangleMesh LargePieces(const TriangleMesh& mesh, double fraction);

// A bone or the skin, ready to be shown. `scan_from_mesh` is where the mesh stands: a bone moves as a whole.
struct NamedSurface {
  std::string name;
  TriangleMesh mesh;
  Eigen::Matrix4d scan_from_mesh = Eigen::Matrix4d::Identity();
  bool is_skin = false;
};

}  // namespace kvx
