// 2 x 2 x 2 samples a voxel through the exact inverse motion; noise from a hash of the voxel, so threads do not matter.
#include "pipeline/phantom/acquisition.h"

#include <algorithm>

namespace kvx::phantom {
namespace {

using Eigen::Vector3d;

constexpr int kSubsamples = 2;         // per axis
constexpr double kBiasScaleMm = 140;   // features of the coil's field

struct Coil {
  double gain, bias;
  uint64_t bias_seed, noise_seed;
};

Coil CoilOf(const Scanner& scanner, int scan) {
  Random random(scanner.seed ^ Mix(uint64_t(scan)), "coil");
  const uint64_t seed = Stream(scanner.seed, "scan") + uint64_t(scan) * 0x9E37ull;
  return {1.0 + random.Uniform(-0.05, 0.05), random.Uniform(0.10, 0.20), Mix(seed), Mix(seed + 1)};
}

struct Seen {
  double intensity = 0;
  bool known = true;   // air, or inside the template scan's view
};

Seen Look(const Vector3d& posed, const CompositeMotion& motion, const MaterialMap& material, double fluid,
          const ScanGrid& grid) {
  const std::optional<MaterialPoint> point = motion.Inverse(posed);
  if (!point) return {motion.InJointGap(posed) ? fluid : 0.0, true};
  const double intensity = material.Intensity(point->rest);
  return {intensity, intensity <= 0 || grid.Sees(point->rest)};
}

double Received(double signal, const Vector3d& x, size_t voxel, const Coil& coil, double sigma) {
  const double field = coil.gain * (1.0 + coil.bias * 1.3 * SmoothNoise(x / kBiasScaleMm, coil.bias_seed));
  const Eigen::Vector2d noise = sigma * NormalPair(coil.noise_seed + voxel * 0x9E3779B97F4A7C15ull);
  return std::clamp(std::hypot(signal * field + noise.x(), noise.y()), 0.0, 255.0);  // Rician
}

}  // namespace

bool ScanGrid::Sees(const Vector3d& x) const {
  return (x.array() >= Origin().array()).all() && (x.array() <= -Origin().array()).all();
}

Grid ScanGrid::World() const {
  Grid grid;
  grid.size = size;
  grid.spacing_mm = spacing_mm;
  grid.direction = Vector3d(-1, -1, 1).asDiagonal();
  grid.origin.lps = Vector3d(-1, -1, 1).cwiseProduct(Origin());
  return grid;
}

ScanImages Acquire(const Scanner& scanner, int scan, const RigidTransform& scan_from_posed, const CompositeMotion& motion,
                   const MaterialMap& material, double fluid_intensity, const Progress& progress) {
  const ScanGrid& grid = scanner.grid;
  const Coil coil = CoilOf(scanner, scan);
  const RigidTransform posed_from_scan = scan_from_posed.Inverse();
  ScanImages images{Volume(grid.World()), Mask(grid.World(), 1)};
  size_t voxel = 0;
  for (int k = 0; k < grid.size.z(); ++k) {
    progress.Report("phantom: scanning", double(k) / grid.size.z());
    for (int j = 0; j < grid.size.y(); ++j) {
      for (int i = 0; i < grid.size.x(); ++i, ++voxel) {
        double signal = 0;
        for (int s = 0; s < kSubsamples * kSubsamples * kSubsamples; ++s) {
          const Vector3d offset = (Vector3d(s % 2, s / 2 % 2, s / 4).array() - 0.5) / kSubsamples;
          const Seen seen = Look(Move(posed_from_scan, grid.At(Vector3d(i, j, k) + offset)), motion, material,
                                 fluid_intensity, grid);
          signal += seen.intensity / (kSubsamples * kSubsamples * kSubsamples);
          if (!seen.known) images.valid.values[voxel] = 0;
        }
        images.intensities.values[voxel] =
            float(Received(signal, grid.At(Vector3d(i, j, k)), voxel, coil, scanner.noise_sigma));
      }
    }
  }
  return images;
}

}  // namespace kvx::phantom
