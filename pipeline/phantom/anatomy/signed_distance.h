// Shapes of the synthetic anatomy: smooth unions of round cones and ellipsoids, as signed distances (mm, < 0
// inside).
#pragma once
#include <vector>

#include "core/frames.h"

namespace kvx::phantom {

// A ball that rolls from a to b while its radius changes linearly. Exact distance.
struct RoundCone {
  Eigen::Vector3d a, b;
  double radius_a_mm = 1, radius_b_mm = 1;
};

// Axis-aligned; the distance is exact on the surface and first-order near it.
struct Ellipsoid {
  Eigen::Vector3d centre, radii_mm;
};

double Distance(const RoundCone& cone, const Eigen::Vector3d& x);
double Distance(const Ellipsoid& ellipsoid, const Eigen::Vector3d& x);
// Polynomial smooth minimum: min(a, b) where they differ by more than `blend`, at most blend / 6 below it
// elsewhere.
double SmoothMin(double a, double b, double blend);

struct Box {
  Eigen::Vector3d low = Eigen::Vector3d::Constant(1e9), high = Eigen::Vector3d::Constant(-1e9);
  void Add(const Eigen::Vector3d& centre, const Eigen::Vector3d& half) {
    low = low.cwiseMin(centre - half);
    high = high.cwiseMax(centre + half);
  }
  bool Contains(const Eigen::Vector3d& x) const {
    return (x.array() >= low.array() && x.array() <= high.array()).all();
  }
  Box Grown(double mm) const { return {low.array() - mm, high.array() + mm}; }
};

// The smooth union of its parts, in order, cut by the slab |x_axis| <= cut_mm.
struct Shape {
  std::vector<RoundCone> cones;
  std::vector<Ellipsoid> ellipsoids;
  double blend_mm = 0;
  Eigen::Vector3d cut_low = Eigen::Vector3d::Constant(-1e6), cut_high = Eigen::Vector3d::Constant(1e6);

  double Distance(const Eigen::Vector3d& x) const;
  Box Bounds() const;
};

}  // namespace kvx::phantom
