// 2 x 2 x 2 samples a voxel through the exact inverse motion; noise from a hash of the voxel, so threads do
// not matter.
#include "pipeline/phantom/acquisition.h"

#include <algorithm>

namespace kvx::phantom {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3i;

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

size_t IndexOf(const Vector3i& v, const Vector3i& size) {
  return (size_t(v.z()) * size.y() + v.y()) * size.x() + v.x();
}

// Voxels that the air around the body reaches from the grid's faces.
std::vector<uint8_t> ReachedByAir(const std::vector<float>& empty, const Vector3i& size) {
  constexpr float kAir = 0.5f;
  std::vector<uint8_t> reached(empty.size(), 0);
  std::vector<Vector3i> front;
  const auto enter = [&](const Vector3i& v) {
    if ((v.array() < 0).any() || (v.array() >= size.array()).any()) return;
    const size_t index = IndexOf(v, size);
    if (reached[index] || empty[index] < kAir) return;
    reached[index] = 1;
    front.push_back(v);
  };
  for (int k = 0; k < size.z(); ++k) {
    for (int j = 0; j < size.y(); ++j) {
      const bool edge = k == 0 || j == 0 || k == size.z() - 1 || j == size.y() - 1;
      for (int i = 0; i < size.x(); i += edge ? 1 : std::max(1, size.x() - 1)) enter({i, j, k});
    }
  }
  while (!front.empty()) {
    const Vector3i v = front.back();
    front.pop_back();
    for (int axis = 0; axis < 3; ++axis) enter(v + Vector3i::Unit(axis)), enter(v - Vector3i::Unit(axis));
  }
  return reached;
}

// Whether one of the mask's voxels is among the 27 around and with this one.
bool IsNear(const std::vector<uint8_t>& mask, const Vector3i& size, size_t index) {
  const Vector3i v(int(index % size.x()), int(index / size.x() % size.y()),
                   int(index / (size_t(size.x()) * size.y())));
  for (int d = 0; d < 27; ++d) {
    const Vector3i w =
        (v + Vector3i(d % 3 - 1, d / 3 % 3 - 1, d / 9 - 1)).cwiseMax(0).cwiseMin((size.array() - 1).matrix());
    if (mask[IndexOf(w, size)]) return true;
  }
  return false;
}

// Nothing that is cut off from the air around the body is a gap of a joint, which fluid fills.
void FillGaps(const ScanGrid& grid, double fluid, Sampled& sampled) {
  const std::vector<uint8_t> outside = ReachedByAir(sampled.empty, grid.size);
  for (size_t index = 0; index < outside.size(); ++index) {
    if (sampled.empty[index] <= 0 || outside[index]) continue;
    if (IsNear(outside, grid.size, index)) continue;  // the skin's partial volumes are not gaps
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
