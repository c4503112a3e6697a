// Boxes of corners where the kernel has closed forms.
#include <algorithm>

#include "kernels/reference/evd.h"

namespace kvx::reference {
namespace {

using Eigen::Vector3d, Eigen::Vector3i;

struct Box {
  Vector3d lo = Vector3d::Constant(INFINITY), hi = Vector3d::Constant(-INFINITY);
  void Take(const Vector3d& p) { lo = lo.cwiseMin(p), hi = hi.cwiseMax(p); }
};

Vector3i Corner(int n) { return {n & 1, (n >> 1) & 1, n >> 2}; }

// Products of two intervals' ends.
void AddProducts(double a_lo, double a_hi, double b_lo, double b_hi, double& lo, double& hi) {
  const auto [least, most] = std::minmax({a_lo * b_lo, a_lo * b_hi, a_hi * b_lo, a_hi * b_hi});
  lo += least, hi += most;
}

struct Bounding {
  const BrickedBody& body;
  const Eigen::MatrixXf& coefficients;
  uint32_t begin, end, first;  // of the palette; the bone with the greatest weight

  Bounding(const BrickedBody& b, int brick, const Eigen::MatrixXf& c)
      : body(b),
        coefficients(c),
        begin(b.palette_first[brick]),
        end(b.palette_first[brick + 1]),
        first(begin) {
    for (uint32_t p = begin; p < end; ++p)
      if (b.weight_ranges[2 * p + 1] > b.weight_ranges[2 * first + 1]) first = p;
  }
  double Least(uint32_t p) const { return p == first ? 1.0 : body.weight_ranges[2 * p]; }
  double Most(uint32_t p) const { return p == first ? 1.0 : body.weight_ranges[2 * p + 1]; }

  // The least and the most by which the examples may displace a node of the brick.
  Box Displacements(int brick) const {
    Box sum{Vector3d::Zero(), Vector3d::Zero()};
    for (uint32_t e = body.example_first[brick]; e < body.example_first[brick + 1]; ++e) {
      const int k = body.example_refs[e].k;
      if (k >= coefficients.cols()) continue;
      double small = 0, great = 0;
      for (uint32_t p = begin; p < end; ++p) {
        const double c =
            coefficients(body.palette[p], k) - (p == first ? 0.0 : coefficients(body.palette[first], k));
        AddProducts(Least(p), Most(p), c, c, small, great);
      }
      for (int a = 0; a < 3; ++a) {
        const float* range = &body.example_ranges[6 * size_t(e) + size_t(a)];
        AddProducts(small, great, range[0], range[3], sum.lo[a], sum.hi[a]);
      }
    }
    return sum;
  }
};

// What the prevailing bone does to the brick's corners, and by how much the others may differ from it.
Box BoxOf(const BrickedBody& body, int brick, const Grid& from, const Grid& to, const PoseVector& pose,
          const Eigen::MatrixXf& coefficients) {
  const Bounding bounding(body, brick, coefficients);
  const Box aside = bounding.Displacements(brick);
  const RigidTransform& main_bone = pose[body.palette[bounding.first]];
  Box box{Vector3d::Zero(), Vector3d::Zero()};
  bool apart = false;
  double others = 0;
  for (uint32_t p = bounding.begin; p < bounding.end; ++p) {
    const RigidTransform& bone = pose[body.palette[p]];
    Box moved;
    for (int n = 0; n < 8; ++n) {
      Vector3d at = (body.FirstNode(brick) + 3 * Corner(n)).cast<double>();
      for (int a = 0; a < 3; ++a) at[a] += Corner(n)[a] ? aside.hi[a] : aside.lo[a];
      const PointMm x = from.ToMm(PointVox{at});
      moved.Take(p == bounding.first ? to.ToVox(bone * x).ijk
                                     : to.ToVox(bone * x).ijk - to.ToVox(main_bone * x).ijk);
    }
    for (int a = 0; a < 3; ++a)
      AddProducts(bounding.Least(p), bounding.Most(p), moved.lo[a], moved.hi[a], box.lo[a], box.hi[a]);
    others += p == bounding.first ? 0 : bounding.Most(p);
    for (uint32_t q = bounding.begin; q < p; ++q)
      apart = apart || !(std::abs(bone.rotation.dot(pose[body.palette[q]].rotation)) > 0.866);
  }
  const double more = apart && others > 0.26 ? 0.5 * (box.hi - box.lo).norm() : 0;
  return {box.lo - Vector3d::Constant(more), box.hi + Vector3d::Constant(more)};
}

}  // namespace

std::vector<uint8_t> EvdReach(const BrickedBody& body, const Grid& from, const Grid& to,
                              const PoseVector& pose, const Eigen::MatrixXf& coefficients, double margin) {
  std::vector<Box> boxes;
  for (int brick = 0; brick < body.stored(); ++brick)
    boxes.push_back(BoxOf(body, brick, from, to, pose, coefficients));
  std::vector<uint8_t> reaches;
  const Vector3d top = (to.size.array() - 1).cast<double>();
  for (int brick = 0; brick < body.cell_bricks; ++brick) {
    Box all;
    for (int n = 0; n < 8; ++n) {
      const Box& box = boxes[size_t(body.BrickOf(body.FirstNode(brick) + 4 * Corner(n)))];
      all.Take(box.lo), all.Take(box.hi);
    }
    reaches.push_back((all.hi.array() >= -margin).all() && (all.lo.array() <= top.array() + margin).all());
  }
  return reaches;
}

}  // namespace kvx::reference
