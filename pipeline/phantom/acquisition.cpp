// 2 x 2 x 2 samples a voxel through the exact inverse motion; noise from a hash of the voxel, so threads do
// not matter.
#include "pipeline/phantom/acquisition.h"

#include <algorithm>

namespace kvx::phantom {
namespace {

using Eigen::Vector3d;

constexpr int kSubsamples = 2;        // per axis
constexpr double kBiasScaleMm = 140;  // features of the coil's field

struct Coil {
  double gain, bias;
  uint64_t bias_seed, noise_seed;
};

Coil CoilOf(const Scanner& scanner, int scan) {
  Random random(scanner.seed ^ Mix(uint64_t(scan)), "coil");
  const uint64_t seed = Stream(scanner.seed, "scan") + uint64_t(scan) * 0x9E37ull;
  return {1.0 + random.Uniform(-0.05, 0.05), random.Uniform(0.10, 0.20), Mix(seed), Mix(seed + 1)};
}

// Samples of the posed body before the scanner touches them.
struct Sampled {
  std::vector<float> signal, empty;  // per voxel: mean intensity, share of samples where there is nothing
  std::vector<uint8_t> known;        // air, or inside the template scan's view
};

void SampleVoxel(const Vector3d& voxel, size_t index, const ScanGrid& grid,
                 const RigidTransform& posed_from_scan, const CompositeMotion& motion,
                 const MaterialMap& material, Sampled& sampled) {
  constexpr int kCount = kSubsamples * kSubsamples * kSubsamples;
  for (int s = 0; s < kCount; ++s) {
    const Vector3d offset = (Vector3d(s % 2, s / 2 % 2, s / 4).array() - 0.5) / kSubsamples;
    const std::optional<MaterialPoint> point = motion.Inverse(Move(posed_from_scan, grid.At(voxel + offset)));
    const double intensity = point ? material.Intensity(point->rest) : 0.0;
    sampled.signal[index] += float(intensity / kCount);
    if (intensity <= 0) sampled.empty[index] += 1.0f / kCount;
    if (intensity > 0 && !grid.Sees(point->rest)) sampled.known[index] = 0;
  }
}

// Nothing that is cut off from the air around the body is a gap of a joint, which fluid fills.
void FillGaps(const ScanGrid& grid, double fluid, Sampled& sampled) {
  constexpr float kAir = 0.5f;
  const Eigen::Vector3i n = grid.size;
  std::vector<uint8_t> outside(sampled.empty.size(), 0);
  std::vector<Eigen::Vector3i> front;
  const auto enter = [&](const Eigen::Vector3i& v) {
    if ((v.array() < 0).any() || (v.array() >= n.array()).any()) return;
    const size_t index = (size_t(v.z()) * n.y() + v.y()) * n.x() + v.x();
    if (outside[index] || sampled.empty[index] < kAir) return;
    outside[index] = 1;
    front.push_back(v);
  };
  for (int k = 0; k < n.z(); ++k) {
    for (int j = 0; j < n.y(); ++j) {
      const bool edge = k == 0 || j == 0 || k == n.z() - 1 || j == n.y() - 1;
      for (int i = 0; i < n.x(); i += edge ? 1 : std::max(1, n.x() - 1)) enter({i, j, k});
    }
  }
  while (!front.empty()) {
    const Eigen::Vector3i v = front.back();
    front.pop_back();
    for (int axis = 0; axis < 3; ++axis)
      enter(v + Eigen::Vector3i::Unit(axis)), enter(v - Eigen::Vector3i::Unit(axis));
  }
  const auto near_outside = [&](size_t index) {  // the skin's partial volumes are not gaps
    const Eigen::Vector3i v(int(index % n.x()), int(index / n.x() % n.y()),
                            int(index / (size_t(n.x()) * n.y())));
    for (int d = 0; d < 27; ++d) {
      const Eigen::Vector3i w = (v + Eigen::Vector3i(d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1))
                                    .cwiseMax(0)
                                    .cwiseMin((n.array() - 1).matrix());
      if (outside[(size_t(w.z()) * n.y() + w.y()) * n.x() + w.x()]) return true;
    }
    return false;
  };
  for (size_t index = 0; index < outside.size(); ++index) {
    if (sampled.empty[index] > 0 && !outside[index] && !near_outside(index))
      sampled.signal[index] += float(fluid) * sampled.empty[index];
  }
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

ScanImages Acquire(const Scanner& scanner, int scan, const RigidTransform& scan_from_posed,
                   const CompositeMotion& motion, const MaterialMap& material, double fluid_intensity,
                   const Progress& progress) {
  const ScanGrid& grid = scanner.grid;
  const Coil coil = CoilOf(scanner, scan);
  const RigidTransform posed_from_scan = scan_from_posed.Inverse();
  ScanImages images{Volume(grid.World()), Mask(grid.World(), 1)};
  const size_t count = images.valid.values.size();
  Sampled sampled{std::vector<float>(count, 0), std::vector<float>(count, 0), std::vector<uint8_t>(count, 1)};
  const auto for_voxels = [&](const auto& visit) {
    size_t index = 0;
    for (int k = 0; k < grid.size.z(); ++k) {
      progress.Report("phantom: scanning", double(k) / grid.size.z());
      for (int j = 0; j < grid.size.y(); ++j) {
        for (int i = 0; i < grid.size.x(); ++i, ++index) visit(Vector3d(i, j, k), index);
      }
    }
  };
  for_voxels([&](const Vector3d& voxel, size_t index) {
    SampleVoxel(voxel, index, grid, posed_from_scan, motion, material, sampled);
  });
  FillGaps(grid, fluid_intensity, sampled);
  for_voxels([&](const Vector3d& voxel, size_t index) {
    images.intensities.values[index] =
        float(Received(sampled.signal[index], grid.At(voxel), index, coil, scanner.noise_sigma));
  });
  images.valid.values = std::move(sampled.known);
  return images;
}

}  // namespace kvx::phantom
