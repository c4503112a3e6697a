// EVD posing of a hand-size model. The paper deforms 255 x 255 x 90 voxels in 3.5 s (section 6.2).
#include <benchmark/benchmark.h>

#include "kernels/evd_pull.h"
#include "pipeline/posing/brick_body.h"

namespace kvx {
namespace {

constexpr int kFingers = 5, kBonesPerFinger = 4, kExamples = 10;

// A palm and five straight fingers of four bones each, separated by air; weights blend over 5 mm at every
// joint.
struct HandLike {
  HandLike();
  void Voxel(size_t v, const Eigen::Vector3d& x);
  ResolvedPose Pose(double bend_rad) const;
  PosingInputs Inputs() const;

  Grid grid;
  Scan scan;
  Mask body;
  BoneSet bones;
  WeightMap weights;
  std::vector<DisplacementField> examples;
};

HandLike::HandLike() {
  grid.size = {256, 256, 100};
  grid.spacing_mm = {0.8, 0.8, 0.9};
  grid.origin.lps = {-102, -20, -45};
  scan.volume = Volume(grid, 3.0f);
  body = Mask(grid);
  weights = WeightMap(grid);
  for (int k = 0; k < kExamples; ++k) examples.emplace_back(grid, Eigen::Vector3f::Zero());
  for (size_t v = 0; v < body.values.size(); ++v)
    Voxel(v, grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps);
  bones.labels = LabelMap(grid);
  bones.bones.resize(kFingers * kBonesPerFinger);
}

void HandLike::Voxel(size_t v, const Eigen::Vector3d& x) {
  const int finger = std::clamp(int(std::floor((x.x() + 50) / 20)), 0, kFingers - 1);
  const double joint = std::clamp(x.y() / 35, 0.0, kBonesPerFinger - 0.501) - 0.5;
  const int first = std::clamp(int(std::floor(joint)), 0, kBonesPerFinger - 2);
  const double t = std::clamp((joint - first - 0.5) * 35 / 5 + 0.5, 0.0, 1.0);
  const int a = finger * kBonesPerFinger + first;
  weights.values[v].bones = {uint8_t(t > 0.5 ? a + 1 : a), uint8_t(t > 0.5 ? a : a + 1), 0, 0};
  weights.values[v].weights = {float(std::max(t, 1 - t)), float(std::min(t, 1 - t)), 0, 0};
  const double across = x.x() + 50 - 20 * finger - 10;
  const bool palm = x.y() > -15 && x.y() < 75 && std::abs(x.x()) < 50 && std::abs(x.z()) < 16;
  const bool digit = x.y() >= 75 && x.y() < 150 && std::hypot(across, x.z()) < 8.8;
  if (!palm && !digit) return;
  body.values[v] = 1;
  scan.volume.values[v] =
      float(120 + 40 * std::sin(0.6 * x.x()) * std::cos(0.5 * x.y()) + 20 * std::sin(0.7 * x.z()));
  for (int k = 0; k < kExamples; ++k) {
    examples[k].values[v] =
        Eigen::Vector3f(std::sin(0.05f * float(x.x()) + k), std::cos(0.04f * float(x.y()) - k),
                        std::sin(0.06f * float(x.z()) + 2 * k));
  }
}

ResolvedPose HandLike::Pose(double bend_rad) const {
  ResolvedPose pose{{}, Eigen::MatrixXf::Constant(kFingers * kBonesPerFinger, kExamples, 0.1f), {}};
  for (int finger = 0; finger < kFingers; ++finger) {
    RigidTransform bone;
    for (int b = 0; b < kBonesPerFinger; ++b) {
      if (b >= 2)
        bone = bone *
               RotationAbout({{0, 35.0 * b, 0}}, Eigen::Vector3d::UnitX(), bend_rad * (0.6 + 0.1 * finger));
      pose.scan_from_template.push_back(bone);
    }
  }
  return pose;
}

PosingInputs HandLike::Inputs() const {
  PosingInputs in{scan, body, bones, weights, {}};
  for (const DisplacementField& d : examples) in.examples.push_back(&d);
  return in;
}

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
    cut(backend.queue(), device, list.buffer(), bricked.cell_bricks, posed, Eigen::Vector3d::Zero(),
        Hand().grid, Hand().grid, cells);
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
