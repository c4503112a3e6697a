// Which deformed tetrahedra hold a place: bins over the posed mesh, tested in order of their number.
#pragma once
#include <vector>

#include "pipeline/phantom/motion/tet_mesh.h"

namespace kvx::phantom {

class TetLocator {
 public:
  TetLocator(const TetMesh& mesh, const std::vector<Eigen::Vector3d>& posed_nodes);

  // Calls visit(tet, rest position) for every upright tetrahedron around `posed`, smallest number first,
  // until it returns true.
  template <class Visit>
  bool ForEachAround(const Eigen::Vector3d& posed, const Visit& visit) const {
    const Eigen::Vector3d p = (posed - box_.low) / bin_mm_;
    if ((p.array() < 0).any() || (p.array() >= bins_.cast<double>().array()).any()) return false;
    const Eigen::Vector3i b = p.cast<int>();
    const size_t bin = (size_t(b.z()) * bins_.y() + b.y()) * bins_.x() + b.x();
    for (size_t i = first_[bin]; i < first_[bin + 1]; ++i) {
      const Inverse& inverse = inverses_[size_t(members_[i])];
      const Eigen::Vector3d along = inverse.fraction_from_posed *
                                    (posed - inverse.corner);  // falls along the walk: 1 >= a >= b >= c >= 0
      constexpr double kSlack = 1e-9;
      if (along[2] < -kSlack || along[1] < along[2] - kSlack || along[0] < along[1] - kSlack ||
          along[0] > 1 + kSlack)
        continue;
      if (visit(members_[i], RestAt(members_[i], along))) return true;
    }
    return false;
  }

 private:
  struct Inverse {
    Eigen::Matrix3d fraction_from_posed = Eigen::Matrix3d::Zero();
    Eigen::Vector3d corner = Eigen::Vector3d::Zero();
  };
  Eigen::Vector3d RestAt(int tet, const Eigen::Vector3d& along) const;
  void FillBins(const std::vector<Eigen::Vector3d>& posed_nodes);

  const TetMesh& mesh_;
  Box box_;
  double bin_mm_ = 1;
  Eigen::Vector3i bins_ = Eigen::Vector3i::Zero();
  std::vector<size_t> first_;
  std::vector<int> members_;
  std::vector<Inverse> inverses_;
};

}  // namespace kvx::phantom
