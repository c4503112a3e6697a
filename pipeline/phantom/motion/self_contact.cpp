// The skin at rest says how deep a place lies; the tetrahedron that holds it carries that depth, and the way
// out, to where it is now.
#include "pipeline/phantom/motion/self_contact.h"

#include <Eigen/LU>
#include <algorithm>
#include <set>

#include "pipeline/phantom/motion/tet_locator.h"

namespace kvx::phantom {
namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

constexpr double kDeepCells = 1.5;     // below the skin, of what can meet
constexpr double kOutsideCells = 0.5;  // above the skin, of what is about to touch
constexpr double kCrushed = 0.05;      // volume over that at rest, below which a tetrahedron says nothing
constexpr double kLeastSlope = 0.1;
constexpr int kEdges[6][2] = {{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}};

}  // namespace

SelfContact::SelfContact(const TetMesh& mesh, std::function<double(const Vector3d&)> skin)
    : mesh_(mesh), skin_(std::move(skin)) {
  AddSamples();
}

void SelfContact::AddSamples() {
  std::vector<double> depth;
  for (const Vector3d& node : mesh_.nodes) depth.push_back(-skin_(node));
  for (size_t n = 0; n < depth.size(); ++n) {
    if (depth[n] < 0 || depth[n] > kDeepCells * mesh_.cell_mm) continue;
    samples_.push_back({{int(n), int(n)}, {1, 0}, mesh_.nodes[n]});
  }
  std::set<std::pair<int, int>> seen;
  for (const std::array<int, 4>& tet : mesh_.tets) {
    for (const auto& [first, second] : kEdges) {
      const int a = tet[size_t(first)], b = tet[size_t(second)];
      const double at_a = depth[size_t(a)], at_b = depth[size_t(b)];
      if ((at_a < 0) == (at_b < 0) || !seen.insert({std::min(a, b), std::max(a, b)}).second) continue;
      const double share = at_a / (at_a - at_b);  // of the way to b
      samples_.push_back({{a, b},
                          {1 - share, share},
                          (1 - share) * mesh_.nodes[size_t(a)] + share * mesh_.nodes[size_t(b)]});
    }
  }
}

// Slope of the skin's distance at rest along ways in the posed body; zero where there is none.
Vector3d SelfContact::PosedSkinSlope(const Vector3d& rest, const std::vector<Vector3d>& posed_nodes) const {
  const int tet = mesh_.Locate(rest).tet;
  if (tet < 0) return Vector3d::Zero();
  const Matrix3d f = DeformationGradient(mesh_, posed_nodes, tet);
  if (f.determinant() < kCrushed) return Vector3d::Zero();
  const double step = 0.1 * mesh_.cell_mm;
  Vector3d slope;
  for (int axis = 0; axis < 3; ++axis) {
    const Vector3d along = step * Vector3d::Unit(axis);
    slope[axis] = (skin_(rest + along) - skin_(rest - along)) / (2 * step);
  }
  return f.inverse().transpose() * slope;
}

// Both points are at one place when they are found, so that the gap is how far that place lies outside the
// other side.
std::optional<SolidContact> SelfContact::ContactOf(const Sample& sample,
                                                   const std::vector<Vector3d>& posed_nodes,
                                                   const TetLocator& locator) const {
  const Vector3d posed = sample.weights[0] * posed_nodes[size_t(sample.nodes[0])] +
                         sample.weights[1] * posed_nodes[size_t(sample.nodes[1])];
  std::optional<Vector3d> other;
  double skin = kOutsideCells * mesh_.cell_mm;
  locator.ForEachAround(posed, [&](int, const Vector3d& rest) {
    if ((rest - sample.rest).norm() < kFarCells * mesh_.cell_mm) return false;
    if (const double d = skin_(rest); d < skin) skin = d, other = rest;
    return false;
  });
  if (!other || skin < -kDeepCells * mesh_.cell_mm) return std::nullopt;
  const Vector3d out = PosedSkinSlope(*other, posed_nodes), own = PosedSkinSlope(sample.rest, posed_nodes);
  const double slope = out.norm();  // of the distance at rest along a way in the posed body
  if (slope < kLeastSlope || own.dot(out) >= 0) return std::nullopt;  // sides that meet face each other
  const TetLocation at = mesh_.Locate(*other);
  SolidContact contact{.normal = out / slope, .gap_mm = skin / slope};
  for (size_t n = 0; n < 4; ++n)
    contact.nodes[n] = mesh_.tets[size_t(at.tet)][n], contact.weights[n] = -at.weights[n];
  for (size_t n = 0; n < 2; ++n)
    contact.nodes[4 + n] = sample.nodes[n], contact.weights[4 + n] = sample.weights[n];
  return contact;
}

std::vector<SolidContact> SelfContact::Find(const std::vector<Vector3d>& posed_nodes) const {
  const TetLocator locator(mesh_, posed_nodes);
  std::vector<SolidContact> found;
  for (const Sample& sample : samples_)
    if (const auto contact = ContactOf(sample, posed_nodes, locator)) found.push_back(*contact);
  return found;
}

double OverlapMm(std::span<const SolidContact> contacts) {
  double deepest = 0;
  for (const SolidContact& contact : contacts) deepest = std::max(deepest, -contact.gap_mm);
  return deepest;
}

}  // namespace kvx::phantom
