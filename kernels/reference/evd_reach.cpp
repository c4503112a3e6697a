// Boxes by dense matrices, in double.
#include <cmath>

#include "core/voxels/to_corner.h"
#include "kernels/reference/evd.h"

namespace kvx::reference {
namespace {

using Eigen::Vector3d, Eigen::Vector3i;

// What lies within `around` of `middle`, axis by axis.
struct Box {
  Vector3d middle = Vector3d::Zero(), around = Vector3d::Zero();
  // Adds products of what lies in `box` and what lies within `by` of w.
  void AddTimes(double w, double by, const Box& box) {
    middle += w * box.middle;
    around += std::abs(w) * box.around + by * (box.middle.cwiseAbs() + box.around);
  }
  Vector3d lo() const { return middle - around; }
  Vector3d hi() const { return middle + around; }
};

Box Moved(const Eigen::Matrix3d& linear, const Vector3d& shift, const Box& box) {
  return {linear * box.middle + shift, linear.cwiseAbs() * box.around};
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
  double Weight(uint32_t p) const {
    return p == first ? 1 : 0.5 * (body.weight_ranges[2 * p + 1] + body.weight_ranges[2 * p]);
  }
  double Spread(uint32_t p) const {
    return p == first ? 0 : 0.5 * (body.weight_ranges[2 * p + 1] - body.weight_ranges[2 * p]);
  }

  // Where examples and what is added may bring the brick's nodes.
  Box Displaced(int brick, std::span<const Vector3d> added) const {
    Box sum{body.FirstNode(brick).cast<double>() + Vector3d::Constant(1.5), Vector3d::Constant(1.5)};
    if (!added.empty()) {
      Vector3d least = Vector3d::Constant(INFINITY), most = -least;
      for (const Vector3d& d : added.subspan(size_t(brick) * BrickedBody::kNodes, BrickedBody::kNodes))
        least = least.cwiseMin(d), most = most.cwiseMax(d);
      sum.AddTimes(1, 0, {0.5 * (least + most), 0.5 * (most - least)});
    }
    for (uint32_t e = body.example_first[brick]; e < body.example_first[brick + 1]; ++e) {
      const int k = body.example_refs[e].k;
      if (k >= coefficients.cols()) continue;
      double c = coefficients(body.palette[first], k), by = 0;
      for (uint32_t p = begin; p < end; ++p) {
        const double more = double(coefficients(body.palette[p], k)) - coefficients(body.palette[first], k);
        c += Weight(p) * more, by += Spread(p) * std::abs(more);
      }
      const float* range = &body.example_ranges[6 * size_t(e)];
      const Eigen::Vector3f least(range[0], range[1], range[2]), most(range[3], range[4], range[5]);
      sum.AddTimes(c, by, {0.5 * (least + most).cast<double>(), 0.5 * (most - least).cast<double>()});
    }
    return sum;
  }
};

struct BrickBox {
  Box box;
  Eigen::Matrix3d main = Eigen::Matrix3d::Identity();  // what the prevailing bone does

  // Of the nodes that face the brick below, `above` it.
  Box Facing(const Vector3i& above) const {
    const Vector3d off = 1.5 * above.cast<double>();
    return {box.middle - main * off, box.around - main.cwiseAbs() * off};
  }
};

// What the prevailing bone does to the brick's box, and by how much the others may differ from it.
BrickBox BoxOf(const BrickedBody& body, int brick, const Grid& grid, const PoseVector& pose,
               const Eigen::MatrixXf& coefficients, std::span<const Vector3d> added) {
  const Bounding bounding(body, brick, coefficients);
  const Box displaced = bounding.Displaced(brick, added);
  Box box;
  const Eigen::Matrix3d main =
      grid.VoxFromMm() * pose[body.palette[bounding.first]].rotation.toRotationMatrix() * grid.MmFromVox();
  bool apart = false;
  double others = 0;
  for (uint32_t p = bounding.begin; p < bounding.end; ++p) {
    const RigidTransform& bone = pose[body.palette[p]];
    const RigidTransform& main_bone = pose[body.palette[bounding.first]];
    Eigen::Matrix3d linear = bone.rotation.toRotationMatrix();
    Vector3d shift = grid.ToVox(bone * grid.origin).ijk;
    if (p != bounding.first) {
      linear -= main_bone.rotation.toRotationMatrix();
      shift -= grid.ToVox(main_bone * grid.origin).ijk;
      others += body.weight_ranges[2 * p + 1];
    }
    box.AddTimes(bounding.Weight(p), bounding.Spread(p),
                 Moved(grid.VoxFromMm() * linear * grid.MmFromVox(), shift, displaced));
    for (uint32_t q = bounding.begin; q < p; ++q)
      apart = apart || !(std::abs(bone.rotation.dot(pose[body.palette[q]].rotation)) > 0.866);
  }
  if (apart && others > 0.5 * (1 - std::cbrt(kRegularDeterminant))) box.around.array() += box.around.norm();
  return {box, main};
}

}  // namespace

std::vector<uint8_t> EvdReach(const BrickedBody& body, const Grid& from, const Grid& to,
                              const PoseVector& pose, const Eigen::MatrixXf& coefficients, double margin,
                              double cut_margin, std::span<const Vector3d> added) {
  std::vector<BrickBox> boxes;
  for (int brick = 0; brick < body.stored(); ++brick)
    boxes.push_back(BoxOf(body, brick, from, pose, coefficients, added));
  std::vector<uint8_t> reaches;
  const Vector3d top = (to.size.array() - 1).cast<double>();
  for (int brick = 0; brick < body.cell_bricks; ++brick) {
    Vector3d lo = Vector3d::Constant(INFINITY), hi = -lo;
    for (int n = 0; n < 8; ++n) {
      const Box box =
          boxes[size_t(body.BrickOf(body.FirstNode(brick) + 4 * ToCorner(n)))].Facing(ToCorner(n));
      lo = lo.cwiseMin(box.lo()), hi = hi.cwiseMax(box.hi());
    }
    const Box all = Moved(to.VoxFromMm() * from.MmFromVox(), to.ToVox(from.origin).ijk,
                          {0.5 * (lo + hi), 0.5 * (hi - lo)});
    const double wider = body.cuts[size_t(brick)][1] ? cut_margin : margin;
    reaches.push_back((all.hi().array() >= -wider).all() && (all.lo().array() <= top.array() + wider).all());
  }
  return reaches;
}

}  // namespace kvx::reference
