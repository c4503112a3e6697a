// Boxes of corners where the kernel has closed forms.
#include "kernels/reference/evd.h"

namespace kvx::reference {
namespace {

using Eigen::Vector3d, Eigen::Vector3i;

struct Box {
  Vector3d lo = Vector3d::Constant(INFINITY), hi = Vector3d::Constant(-INFINITY);
  void Take(const Vector3d& p) { lo = lo.cwiseMin(p), hi = hi.cwiseMax(p); }
};

Vector3i Corner(int n) { return {n & 1, (n >> 1) & 1, n >> 2}; }

double MostAside(const BrickedBody& body, int brick, const Eigen::MatrixXf& coefficients) {
  double sum = 0;
  for (uint32_t e = body.example_first[brick]; e < body.example_first[brick + 1]; ++e) {
    if (body.example_refs[e].k >= coefficients.cols()) continue;
    double most = 0;
    for (uint32_t p = body.palette_first[brick]; p < body.palette_first[brick + 1]; ++p)
      most = std::max(most, double(std::abs(coefficients(body.palette[p], body.example_refs[e].k))));
    sum += most * 32767.0 * body.example_refs[e].scale;
  }
  return sum;
}

Box BoxOf(const BrickedBody& body, int brick, const Grid& from, const Grid& to, const PoseVector& pose,
          const Eigen::MatrixXf& coefficients) {
  const double aside = MostAside(body, brick, coefficients);
  Box box;
  bool bows = false;
  for (uint32_t p = body.palette_first[brick]; p < body.palette_first[brick + 1]; ++p) {
    const RigidTransform& bone = pose[body.palette[p]];
    for (int n = 0; n < 8; ++n) {
      const Vector3d outward = (2 * Corner(n)).cast<double>() - Vector3d::Ones();
      const Vector3d at = (body.FirstNode(brick) + 3 * Corner(n)).cast<double>() + aside * outward;
      box.Take(to.ToVox(bone * from.ToMm(PointVox{at})).ijk);
    }
    for (uint32_t q = body.palette_first[brick]; q < p; ++q)
      bows = bows || !(std::abs(bone.rotation.dot(pose[body.palette[q]].rotation)) > 0.866);
  }
  const double more = bows ? 0.5 * (box.hi - box.lo).norm() : 0;
  return {box.lo - Vector3d::Constant(more), box.hi + Vector3d::Constant(more)};
}

}  // namespace

std::vector<uint8_t> EvdReach(const BrickedBody& body, const Grid& from, const Grid& to, const PoseVector& pose,
                              const Eigen::MatrixXf& coefficients, double margin) {
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
