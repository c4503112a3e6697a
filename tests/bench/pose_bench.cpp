// EVD posing of a hand-size model. The paper deforms 255 x 255 x 90 voxels in 3.5 s (section 6.2).
#include <benchmark/benchmark.h>

#include "kernels/evd_pull.h"
#include "pipeline/model/pose_equilibrium.h"
#include "pipeline/posing/brick_body.h"
#include "tests/bench/hand_like.h"

namespace kvx {
namespace {

const HandLike& Hand() {
  static const HandLike hand;
  return hand;
}

Backend& BenchBackend() {
  static Backend backend;
  return backend;
}

void BM_Pose(benchmark::State& state) {
  const PosingEngine engine(BenchBackend(), Hand().Inputs());
  const ResolvedPose pose = Hand().Pose(0.8);
  engine.Pose(pose, Hand().grid);
  for (auto _ : state) benchmark::DoNotOptimize(engine.Pose(pose, Hand().grid));
  state.SetItemsProcessed(int64_t(state.iterations()) * int64_t(Hand().grid.VoxelCount()));
  state.SetLabel(BenchBackend().device_name());  // a number without its device is not a result
}
BENCHMARK(BM_Pose)->Unit(benchmark::kMillisecond)->UseRealTime();

void BM_PoseOnItsFittedGrid(benchmark::State& state) {
  const PosingEngine engine(BenchBackend(), Hand().Inputs());
  const ResolvedPose pose = Hand().Pose(0.8);
  engine.Pose(pose);
  for (auto _ : state) benchmark::DoNotOptimize(engine.Pose(pose));
  state.SetLabel(BenchBackend().device_name());
}
BENCHMARK(BM_PoseOnItsFittedGrid)->Unit(benchmark::kMillisecond)->UseRealTime();

// What an elastic pose takes beside BM_Pose.
void BM_PoseEquilibrium(benchmark::State& state) {
  const BrickedBody bricked = BrickBody(Hand().Inputs());
  std::vector<PoseVector> scans;
  for (size_t k = 0; k < Hand().examples.size(); ++k)
    scans.push_back(Hand().Pose(0.1 * double(k)).scan_from_template);
  const PoseEquilibrium equilibrium(
      {Hand().body, Hand().bones.labels, Hand().weights, bricked, scans, {}, {}, {}}, BenchBackend());
  double bend_rad = 0.8;  // never the same: the last is kept
  for (auto _ : state) {
    ResolvedPose pose = Hand().Pose(bend_rad += 1e-3);
    pose.elastic = true;
    benchmark::DoNotOptimize(equilibrium.BeyondExamples(pose));
  }
  state.SetLabel(BenchBackend().device_name());
}
BENCHMARK(BM_PoseEquilibrium)->Unit(benchmark::kMillisecond)->UseRealTime();

// The stages of one pose, each on buffers that the ones before left behind.
struct Stages {
  Stages() {
    for (int brick = 0; brick < bricked.stored(); ++brick) every.push_back(brick);
    list = DeviceBuffer<int32_t>(backend, every);
    Forward(), Cut(), Pull();
  }
  void Forward() {
    const ResolvedPose p = Hand().Pose(0.8);
    forward(backend.queue(), device, list.buffer(), device.stored,
            ForwardPose(Hand().grid, Hand().grid, p.scan_from_template, p.coefficients), posed);
    backend.queue().finish();
  }
  void Cut() {
    cut(backend.queue(), device, list.buffer(), bricked.cell_bricks, posed,
        Hand().Pose(0.8).scan_from_template, Eigen::Vector3d::Zero(), Hand().grid, Hand().grid, cells);
  }
  void Pull() {
    pull.Intensities(backend.queue(), device, list.buffer(), cells, Hand().grid, image, Hand().grid,
                     Sampling::kLinear, 3.0f, out.buffer());
    backend.queue().finish();
  }

  Backend& backend = BenchBackend();
  BrickedBody bricked = BrickBody(Hand().Inputs());
  DeviceBody device{backend, bricked};
  BufferCounts counts;
  std::vector<int32_t> every;
  DeviceBuffer<int32_t> list;
  PosedNodes posed{backend, counts};
  PosedCells cells{backend, counts};
  DeviceBuffer<float> out{backend, Hand().grid.VoxelCount()};
  DeviceBuffer<float> image{backend, std::span(Hand().scan.volume.values)};
  EvdForward forward{backend};
  EvdCells cut{backend};
  EvdPull pull{backend};
};

void BM_PoseStage(benchmark::State& state, void (Stages::*stage)()) {
  Stages stages;
  for (auto _ : state) (stages.*stage)();
  state.SetLabel(BenchBackend().device_name());
}
BENCHMARK_CAPTURE(BM_PoseStage, forward, &Stages::Forward)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(BM_PoseStage, cells, &Stages::Cut)->Unit(benchmark::kMillisecond)->UseRealTime();
BENCHMARK_CAPTURE(BM_PoseStage, pull, &Stages::Pull)->Unit(benchmark::kMillisecond)->UseRealTime();

}  // namespace
}  // namespace kvx
