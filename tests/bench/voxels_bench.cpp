// Passes over all voxels of a full-scale scan, beside a mere copy of its greys.
#include <benchmark/benchmark.h>

#include "core/voxels/distance_transform.h"
#include "core/voxels/nearest_voxel.h"

namespace kvx {
namespace {

// A limb: what lies in it is half of the grid.
const Mask& Limb() {
  static const Mask limb = [] {
    Grid grid;
    grid.size = {256, 256, 136};
    Mask mask(grid);
    for (size_t v = 0; v < mask.values.size(); ++v) {
      const Eigen::Vector2d from_middle = grid.Ijk(v).head<2>().cast<double>().array() - 127.5;
      mask.values[v] = from_middle.norm() < 102;
    }
    return mask;
  }();
  return limb;
}

void BM_CopyOfAVolume(benchmark::State& state) {
  const Volume volume(Limb().grid);
  for (auto _ : state) benchmark::DoNotOptimize(Volume(volume));
}
BENCHMARK(BM_CopyOfAVolume)->Unit(benchmark::kMillisecond)->UseRealTime();

void BM_DistanceMap(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(DistanceMapMm(Limb()));
}
BENCHMARK(BM_DistanceMap)->Unit(benchmark::kMillisecond)->UseRealTime();

void BM_NearestMarked(benchmark::State& state) {
  for (auto _ : state) benchmark::DoNotOptimize(NearestMarked(Limb()));
}
BENCHMARK(BM_NearestMarked)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace kvx
