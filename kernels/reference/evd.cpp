// Double precision and dense linear algebra where the kernels have closed forms.
#include "kernels/reference/evd.h"

#include <algorithm>
#include <cmath>
#include <optional>

namespace kvx::reference {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d, Eigen::Vector3i;
constexpr uint32_t kNone = 0xFFFFFFFFu;
constexpr int kPaths[6][3] = {{0, 1, 2}, {1, 2, 0}, {2, 0, 1}, {0, 2, 1}, {2, 1, 0}, {1, 0, 2}};

Vector3d PosedNode(const BrickedBody& body, const Places& posed, const Vector3i& node) {
  return posed[size_t(body.BrickOf(node)) * BrickedBody::kNodes + BrickedBody::Slot(node)];
}

struct Tetrahedron {
  Vector3i base;
  int step;
  const int* path;
  Vector3d corners[4];
  Matrix3d posed_from_path, path_from_posed;
  double determinant;  // of d posed / d template

  Tetrahedron(const BrickedBody& body, const Places& posed, const Vector3i& at, int edge, int tet)
      : base(at), step(edge), path(kPaths[tet]) {
    Vector3i node = base;
    corners[0] = PosedNode(body, posed, node);
    for (int i = 0; i < 3; ++i) {
      node[path[i]] += step;
      corners[i + 1] = PosedNode(body, posed, node);
      posed_from_path.col(i) = (corners[i + 1] - corners[i]) / step;
    }
    path_from_posed = posed_from_path.inverse();
    determinant = posed_from_path.determinant() * (tet < 3 ? 1 : -1);
  }
  Vector3d PathPlace(const Vector3d& p) const { return path_from_posed * (p - corners[0]); }
  Vector3d TemplatePlace(const Vector3d& g) const {
    Vector3d v = base.cast<double>();
    for (int i = 0; i < 3; ++i) v[path[i]] += g[i];
    return v;
  }
  bool Holds(const Vector3d& g, double grow) const {
    return step - g[0] >= -grow && g[0] - g[1] >= -grow && g[1] - g[2] >= -grow && g[2] >= -grow;
  }
};

Vector3i Rounded(const Vector3d& v) { return v.array().rint().cast<int>(); }

double Stretch(const Tetrahedron& t, const Grid& from, const Grid& to) {
  double most = 0;
  for (int i = 0; i < 3; ++i) {
    most = std::max(most,
                    t.posed_from_path.col(i).cwiseProduct(to.spacing_mm).norm() / from.spacing_mm[t.path[i]]);
  }
  return most;
}

void Claim(const Tetrahedron& t, uint32_t id, bool all_body, double grow, bool inverted,
           const BrickedBody& body, const Grid& grid, std::vector<uint32_t>& owner) {
  Vector3d lo = t.corners[0], hi = t.corners[0];
  for (const Vector3d& c : t.corners) lo = lo.cwiseMin(c), hi = hi.cwiseMax(c);
  const Vector3d pad = grow * t.posed_from_path.cwiseAbs().rowwise().sum();
  const Vector3i first = (lo - pad).array().ceil().max(0).cast<int>();
  const Vector3i last = (hi + pad).array().floor().min((grid.size.array() - 1).cast<double>()).cast<int>();
  for (int z = first.z(); z <= last.z(); ++z) {
    for (int y = first.y(); y <= last.y(); ++y) {
      for (int x = first.x(); x <= last.x(); ++x) {
        const Vector3d g = t.PathPlace(Vector3d(x, y, z));
        if (!t.Holds(g, grow)) continue;
        const Vector3i node = Rounded(t.TemplatePlace(g));
        const bool is_body = all_body || body.Bit(body.body, node);
        if (!is_body && (inverted || !body.Bit(body.carried, node))) continue;
        const uint32_t kind = is_body ? (inverted ? 2 : 0) : 1;
        uint32_t& own = owner[grid.Index(x, y, z)];
        own = std::min(own, (kind << 30) | id);
      }
    }
  }
}

bool AllBits(const BrickedBody& body, const std::vector<uint64_t>& bits, const Vector3i& base, bool any) {
  for (int corner = 0; corner < 8; ++corner) {
    if (body.Bit(bits, base + Vector3i(corner & 1, (corner >> 1) & 1, corner >> 2)) == any) return any;
  }
  return !any;
}

// Trilinear forward map at a template place, and its derivative.
struct Forward {
  Vector3d place;
  Matrix3d slope;
};

std::optional<Forward> ForwardAt(const BrickedBody& body, const Places& posed, const Vector3d& v) {
  const Vector3i n = v.array().floor().cast<int>();
  const int brick = body.BrickOf(n);
  if (brick < 0 || brick >= body.cell_bricks) return std::nullopt;
  Forward out{Vector3d::Zero(), Matrix3d::Zero()};
  const Vector3d f = v - n.cast<double>();
  for (int corner = 0; corner < 8; ++corner) {
    const Vector3i d(corner & 1, (corner >> 1) & 1, corner >> 2);
    Vector3d part, sign;
    for (int a = 0; a < 3; ++a) part[a] = d[a] ? f[a] : 1 - f[a], sign[a] = d[a] ? 1 : -1;
    const Vector3d c = PosedNode(body, posed, n + d);
    out.place += part.prod() * c;
    for (int a = 0; a < 3; ++a) out.slope.col(a) += sign[a] * part[(a + 1) % 3] * part[(a + 2) % 3] * c;
  }
  return out;
}

double Refine(const BrickedBody& body, const Places& posed, const Vector3d& p, Vector3d& v) {
  double best = INFINITY;
  Vector3d place = v;
  for (int step = 0; step <= 4; ++step) {
    const auto at = ForwardAt(body, posed, place);
    if (!at) break;
    const Vector3d r = p - at->place;
    if (r.squaredNorm() < best) best = r.squaredNorm(), v = place;
    if (best < 1e-6 || std::abs(at->slope.determinant()) < 1e-4) break;
    const Vector3d move = at->slope.inverse() * r;
    place += move * std::min(1.0, 1.5 / move.norm());
    if (r.squaredNorm() < 4e-3 && r.squaredNorm() == best) {
      v = place;
      break;
    }
  }
  return best;
}

uint32_t NeighbourOwner(const std::vector<uint32_t>& owner, const Grid& grid, const Vector3i& p) {
  uint32_t least = kNone;
  for (int side = 0; side < 6; ++side) {
    Vector3i q = p;
    q[side / 2] += side % 2 ? 1 : -1;
    if (grid.Contains(q)) least = std::min(least, owner[grid.Index(q.x(), q.y(), q.z())]);
  }
  return least;
}

std::optional<Vector3d> Invert(const BrickedBody& body, const Places& posed,
                               const std::vector<uint32_t>& owner, const Grid& grid, const Vector3i& p) {
  const uint32_t own = owner[grid.Index(p.x(), p.y(), p.z())],
                 key = own != kNone ? own : NeighbourOwner(owner, grid, p);
  if (own == kNone && key >> 30 != 0) return std::nullopt;
  const uint32_t id = key & 0x3FFFFFFFu, cell = id / 6, slot = cell % 65;
  const Vector3i offset = slot ? BrickedBody::Offset(int(slot) - 1) : Vector3i(Vector3i::Zero());
  const Tetrahedron t(body, posed, body.FirstNode(int(cell / 65)) + offset, slot ? 1 : 4, int(id % 6));
  const Vector3d guess = t.TemplatePlace(t.PathPlace(p.cast<double>()));
  Vector3d v = guess;
  if (!(Refine(body, posed, p.cast<double>(), v) < 0.09)) {
    if (own == kNone) return std::nullopt;
    v = guess;
  }
  if (!body.Bit(body.carried, Rounded(v))) return std::nullopt;
  return v;
}

}  // namespace

Places EvdForward(const BrickedBody& body, const Grid& from, const Grid& to, const PoseVector& pose,
                  const Eigen::MatrixXf& coefficients) {
  Places posed(size_t(body.stored()) * BrickedBody::kNodes);
  for (size_t node = 0; node < posed.size(); ++node) {
    const int brick = int(node / BrickedBody::kNodes), slot = int(node % BrickedBody::kNodes);
    const VoxelWeights w{body.bones[node], body.weights[node]};
    Vector3d v = (body.FirstNode(brick) + BrickedBody::Offset(slot)).cast<double>();
    for (int k = 0; k < coefficients.cols(); ++k) {
      double c = 0;
      for (int s = 0; s < kBonesPerVoxel; ++s) c += double(w.weights[s]) * coefficients(w.bones[s], k);
      for (int a = 0; a < 3; ++a) {
        const size_t at = ((size_t(brick) * body.example_count + k) * 3 + a) * BrickedBody::kNodes + slot;
        v[a] += c * body.example_scales[k] * body.examples[at];
      }
    }
    posed[node] = to.ToVox({Apply(Blend(w, pose), from.ToMm(PointVox{v}).lps)}).ijk;
  }
  return posed;
}

std::vector<uint8_t> SmoothBricks(const BrickedBody& body, const Places& posed, double volume_ratio) {
  std::vector<uint8_t> smooth(body.cell_bricks, 1);
  for (int brick = 0; brick < body.cell_bricks; ++brick) {
    for (int tet = 0; tet < 6; ++tet) {
      const Tetrahedron t(body, posed, body.FirstNode(brick), 4, tet);
      const double ratio = t.determinant * volume_ratio;
      if (!(ratio > 0.08 && ratio < 5)) smooth[brick] = 0;
      for (int n = 0; n < 125; ++n) {
        const Vector3i f(n % 5, n / 5 % 5, n / 25);
        const Vector3d g(f[t.path[0]], f[t.path[1]], f[t.path[2]]);
        if (!t.Holds(g, 0)) continue;
        const Vector3d error = PosedNode(body, posed, t.base + f) - (t.corners[0] + t.posed_from_path * g);
        if (!(error.norm() < 0.25)) smooth[brick] = 0;
      }
    }
  }
  return smooth;
}

std::vector<uint32_t> RasteriseTetrahedra(const BrickedBody& body, const Places& posed,
                                          const std::vector<uint8_t>& smooth, const Grid& from,
                                          const Grid& to) {
  std::vector<uint32_t> owner(to.VoxelCount(), kNone);
  const double volume_ratio = to.MmFromVox().determinant() / from.MmFromVox().determinant();
  for (int brick = 0; brick < body.cell_bricks; ++brick) {
    for (int n = 0; n < (smooth[brick] ? 1 : BrickedBody::kNodes); ++n) {
      const Vector3i base =
          body.FirstNode(brick) + (smooth[brick] ? Vector3i(Vector3i::Zero()) : BrickedBody::Offset(n));
      const bool closed = body.closed[brick] || (!smooth[brick] && AllBits(body, body.body, base, false));
      if (!smooth[brick] && !AllBits(body, body.carried, base, true)) continue;
      for (int tet = 0; tet < 6; ++tet) {
        const Tetrahedron t(body, posed, base, smooth[brick] ? 4 : 1, tet);
        const double ratio = t.determinant * volume_ratio;
        if (!(std::abs(ratio) > 0.02 && std::abs(ratio) < 20)) continue;
        if (!closed && !smooth[brick] && Stretch(t, from, to) > 4) continue;
        const uint32_t id = (uint32_t(brick) * 65 + (smooth[brick] ? 0 : 1 + n)) * 6 + tet;
        Claim(t, id, closed, smooth[brick] ? 0.35 : 0.02, ratio < 0, body, to, owner);
      }
    }
  }
  return owner;
}

Volume EvdInverseSample(const BrickedBody& body, const Places& posed, const std::vector<uint32_t>& owner,
                        const Grid& grid, const Volume& image, float air) {
  Volume out(grid, air);
  const Vector3d top = (image.grid.size.array() - 1).cast<double>();
  for (size_t p = 0; p < out.values.size(); ++p) {
    const auto v = Invert(body, posed, owner, grid, grid.Ijk(p));
    if (!v) continue;
    const Vector3d inside = v->cwiseMax(0.0).cwiseMin(top);
    if ((inside - *v).cwiseAbs().maxCoeff() < 0.01)
      out.values[p] = SampleTrilinear(image, PointVox{inside}, air);
  }
  return out;
}

}  // namespace kvx::reference
