// Marching tetrahedra: no ambiguous cases, so no holes. Two slices of edges are remembered at a time.
#include "pipeline/surface/level_surface.h"

#include <algorithm>

#include "core/voxels/to_corner.h"

namespace kvx {
namespace {

// A tetrahedron goes from corner 0 of a cell to corner 7 along three different axes, one order of the axes
// each. Corners are numbered by their bits: 1 along i, 2 along j, 4 along k.
constexpr int kTetrahedra[6][4] = {{0, 1, 3, 7}, {0, 1, 5, 7}, {0, 2, 3, 7},
                                   {0, 2, 6, 7}, {0, 4, 5, 7}, {0, 4, 6, 7}};
// Of an edge, from a voxel's centre: vertices of different edges stay apart
constexpr double kLeastShare = 0.02;
constexpr uint32_t kNone = UINT32_MAX;

class Marching {
 public:
  explicit Marching(const Volume& values) : values_(values), n_(values.grid.size) {
    const size_t slice = size_t(n_.x()) * size_t(n_.y()) * 7;
    below_.assign(slice, kNone), above_.assign(slice, kNone);
    mirrored_ = values.grid.direction.determinant() < 0;
  }

  TriangleMesh Run() {
    for (int k = 0; k + 1 < n_.z(); ++k) {
      for (int j = 0; j + 1 < n_.y(); ++j) {
        for (int i = 0; i + 1 < n_.x(); ++i) Cell({i, j, k});
      }
      below_.swap(above_);
      std::fill(above_.begin(), above_.end(), kNone);
    }
    return std::move(mesh_);
  }

 private:
  void Cell(const Eigen::Vector3i& at) {
    float value[8];
    int inside = 0;
    for (int corner = 0; corner < 8; ++corner) {
      const Eigen::Vector3i p = at + ToCorner(corner);
      value[corner] = values_(p.x(), p.y(), p.z());
      inside += value[corner] > 0;
    }
    if (inside == 0 || inside == 8) return;
    for (const auto& tetrahedron : kTetrahedra) Tetrahedron(at, tetrahedron, value);
  }

  void Tetrahedron(const Eigen::Vector3i& at, const int (&corners)[4], const float (&value)[8]) {
    int in[4], out[4], ins = 0, outs = 0;
    for (const int corner : corners) {
      if (value[corner] > 0)
        in[ins++] = corner;
      else
        out[outs++] = corner;
    }
    if (ins == 0 || outs == 0) return;
    const Eigen::Vector3d outwards = Middle(out, outs) - Middle(in, ins);
    const auto vertex = [&](int a, int b) { return Vertex(at, a, b, value); };
    if (ins == 1)
      return Triangle(vertex(in[0], out[0]), vertex(in[0], out[1]), vertex(in[0], out[2]), outwards);
    if (outs == 1)
      return Triangle(vertex(in[0], out[0]), vertex(in[1], out[0]), vertex(in[2], out[0]), outwards);
    const uint32_t a = vertex(in[0], out[0]), b = vertex(in[0], out[1]), c = vertex(in[1], out[1]),
                   d = vertex(in[1], out[0]);
    Triangle(a, b, c, outwards);
    Triangle(a, c, d, outwards);
  }

  static Eigen::Vector3d Middle(const int* corners, int count) {
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    for (int c = 0; c < count; ++c) sum += ToCorner(corners[c]).cast<double>();
    return sum / count;
  }

  // Each edge has one vertex, whichever cell asks first.
  // The edge starts at the corner whose bits the other contains.
  uint32_t Vertex(const Eigen::Vector3i& at, int a, int b, const float (&value)[8]) {
    const int first = a & b, last = a | b;
    const Eigen::Vector3i start = at + ToCorner(first);
    auto& edges = start.z() == at.z() ? below_ : above_;
    uint32_t& found =
        edges[(size_t(start.y()) * size_t(n_.x()) + size_t(start.x())) * 7 + size_t((last ^ first) - 1)];
    if (found != kNone) return found;
    const double share = double(value[first]) / (double(value[first]) - double(value[last]));
    const Eigen::Vector3d along = ToCorner(last ^ first).cast<double>();
    const Eigen::Vector3d place =
        start.cast<double>() + std::clamp(share, kLeastShare, 1 - kLeastShare) * along;
    found = uint32_t(places_.size());
    places_.push_back(place);
    mesh_.vertices_mm.push_back(values_.grid.ToMm(PointVox{place}).lps.cast<float>());
    return found;
  }

  void Triangle(uint32_t a, uint32_t b, uint32_t c, const Eigen::Vector3d& outwards) {
    const Eigen::Vector3d normal = (places_[b] - places_[a]).cross(places_[c] - places_[a]);
    if ((normal.dot(outwards) < 0) != mirrored_) std::swap(b, c);
    mesh_.triangles.push_back({a, b, c});
  }

  const Volume& values_;
  const Eigen::Vector3i n_;
  bool mirrored_ = false;
  std::vector<uint32_t> below_, above_;  // vertices of the edges that start in this slice and the next
  std::vector<Eigen::Vector3d> places_;  // voxels
  TriangleMesh mesh_;
};

}  // namespace

TriangleMesh LevelSurface(const Volume& values) {
  if ((values.grid.size.array() < 2).any()) return {};
  return Marching(values).Run();
}

}  // namespace kvx
