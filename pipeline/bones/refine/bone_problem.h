// One bone against one scan, its neighbours held: residuals, trust, normal equations and spread (eq. 1 with
// skinned surroundings).
// Template and scan are compared both ways: at voxels of the template, between those of the scan, and at
// voxels of the scan, between those of the template. What lies between voxels is known only roughly where
// edges are finer than these; the errors of the two ways have little to do with each other.
// Where slices are thick, both images are blurred until they show alike, and places count less that the
// spline between slices may miss.
#pragma once
#include <map>
#include <optional>

#include "core/pose.h"
#include "pipeline/bones/refine/pose_equations.h"
#include "pipeline/bones/template/bone_tissue.h"
#include "pipeline/scans/alike_images.h"

namespace kvx {

class BoneProblem {
 public:
  using Row = PoseEquations::Row;  // turn about the centroid, shift (template frame), gain, bias
  using Normal = PoseEquations::Normal;

  // Voxels of the scan are chosen where `poses` puts the bone. Everything given must outlive this.
  BoneProblem(const BoneTissue& tissue, const CubicImage& template_image, const CubicImage& scan,
              const PoseVector& poses, int bone);

  void Look(const RigidTransform& pose);  // residuals with the best gain and bias
  void Trust();                           // less where the last look was odd; then residuals anew
  // Gauss-Newton for the bone's motion, gain and bias, the slip of the surroundings eliminated.
  Normal Equations(Row& right) const;
  Twist6Covariance Covariance() const;
  double Correlation() const;
  double SeenPart() const;  // of the template's voxels

 private:
  // A place where template and scan are compared.
  struct Pair {
    size_t sample;                   // of the template: its weights and distance hold
    double share;                    // of an observation that it counts as
    Eigen::Vector3d from_centre_mm;  // in the template
    double in_template = 0, in_scan = 0;
    // Per mm, in the template's frame.
    Eigen::Vector3d template_slope = Eigen::Vector3d::Zero(), scan_slope = Eigen::Vector3d::Zero();
    double trust = 0;  // share and all
    double residual = 0;
    double missed_variance = 0;  // of what is looked up between slices
    bool seen = false;
    // Of a voxel of the scan, in the scan's frame.
    Eigen::Vector3d voxel_mm = Eigen::Vector3d::Zero(), voxel_slope = Eigen::Vector3d::Zero();
  };
  // Weighted motions of bones, added up (eq. 2 with the weights of one place).
  struct Blend {
    Eigen::Matrix3d linear = Eigen::Matrix3d::Zero();
    Eigen::Vector3d shift_mm = Eigen::Vector3d::Zero();
    Blend() = default;
    explicit Blend(const RigidTransform& motion)
        : linear(motion.rotation.toRotationMatrix()), shift_mm(motion.translation_mm) {}
    void Add(double weight, const Blend& motion);
    Eigen::Vector3d operator()(const Eigen::Vector3d& x) const { return linear * x + shift_mm; }
  };
  // What pairs within the bone and pairs around it say.
  struct Halves {
    PoseEquations within, around;
  };
  // The surroundings may have slipped along the bone together, as one: a motion of its own, of known spread,
  // that takes from them what they say about the bone's.
  struct Softening {
    Eigen::Matrix<double, 8, 6> by_slip;  // what is taken per unit of a row's motion part
    Row Of(const Row& row) const { return row - by_slip * row.head<6>(); }
    Normal Of(const Normal& around) const { return around - by_slip * around.topRows<6>(); }
  };
  // Pairs near each other: their part of the equations.
  struct Cluster {
    Normal normal = Normal::Zero();
    Row right = Row::Zero();
  };

  const TissueSample& SampleOf(const Pair& pair) const { return tissue_.samples[pair.sample]; }
  bool IsAround(const Pair& pair) const { return SampleOf(pair).away_mm > 0; }
  Blend ScanFromTemplate(size_t sample, const Blend& pose) const;
  std::optional<size_t> SampleAt(const Eigen::Vector3d& in_template_mm) const;
  void PairVoxelsOfTemplate(double share);
  void Blur(Pair& pair) const;
  void PairVoxelsOfScan(const RigidTransform& pose, double share);
  void PairVoxelOfScan(const Eigen::Vector3i& voxel, const Blend& pose, double share);
  void LookFromTemplate(const Blend& pose, Pair& pair) const;
  void LookFromScan(const Blend& pose, Pair& pair) const;
  void FitGain();  // and residuals
  Row RowOf(const Pair& pair) const;
  Row RowWith(const Pair& pair, const Eigen::Vector3d& slope) const;
  Softening SofteningOf(const Normal& around) const;
  Halves Sums() const;
  Halves Signal() const;
  std::map<std::array<int, 3>, Cluster> Clusters(const Softening& soft) const;
  double ResidualVariance() const;
  double NoiseSd() const;

  const BoneTissue& tissue_;
  Likening alike_;  // as the bone lies at first
  BlurredImage template_image_, scan_;
  Eigen::Matrix3d template_vox_from_mm_, scan_vox_from_mm_;
  std::vector<Blend> others_;  // what its other bones do to each sample
  std::vector<Pair> pairs_;    // at voxels of the template, one for each sample, then at voxels of the scan
  double gain_ = 1, bias_ = 0, noise_ = 1;
};

}  // namespace kvx
