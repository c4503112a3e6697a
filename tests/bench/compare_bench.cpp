// A whole pose beside ITK's WarpImageFilter in one run, batches, planes, and how time grows. Of a hand-like
// body, or of the model that $KVX_BENCH_MODEL names at 0.7 times the joint angles of its last scan. Read
// the CPU column on a machine that is not quiet.
#include <benchmark/benchmark.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>

#include "pipeline/model/model.h"
#include "pipeline/posing/posed_slice.h"
#include "tests/bench/hand_like.h"
#include "tests/bench/itk_warp.h"

namespace kvx {
namespace {

constexpr int kBatch = 100;
constexpr double kBend = 0.8;  // rad, of the hand-like body; 1 for a model's own angles

Backend& SharedDevice() {
  static Backend backend;
  return backend;
}

// What is posed, and poses of it between rest (0) and the greatest (1).
struct Subject {
  Subject() {
    if (const char* folder = std::getenv("KVX_BENCH_MODEL")) {
      model = std::make_unique<Model>(Model::Load(folder));
      engine = model->MakeEngine(SharedDevice());
    } else {
      hand = std::make_unique<HandLike>();
      engine = std::make_unique<PosingEngine>(SharedDevice(), hand->Inputs());
    }
  }
  const Volume& image() const { return model ? model->template_scan().volume : hand->scan.volume; }
  ResolvedPose Pose(double part) const {
    if (!model) return hand->Pose(kBend * part);
    const JointAngles angles = 0.7 * part * model->fit().scan_angles.back();
    return model->Resolver().ResolveAngles(angles, DeformationMode::kEvd);
  }
  std::unique_ptr<Model> model;
  std::unique_ptr<HandLike> hand;
  std::unique_ptr<PosingEngine> engine;
};

const Subject& TheSubject() {
  static const Subject subject;
  return subject;
}

// What ITK is given ready-made: how far from each posed voxel its template place lies; 0 where nothing lands.
DisplacementField TemplateFromPosed(const Subject& subject, const ResolvedPose& pose, const Grid& grid) {
  const PlaceField places = subject.engine->InversePlaces(pose, grid);
  DisplacementField field(grid, Eigen::Vector3f::Zero());
  for (size_t v = 0; v < field.values.size(); ++v) {
    const Eigen::Vector3f here = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps.cast<float>();
    if (places.values[v].allFinite()) field.values[v] = places.values[v] - here;
  }
  return field;
}

struct Spent {
  double wall_ms = 0, cpu_ms = 0;  // of all threads
};

template <class Work>
void Spend(Spent& spent, Work work) {
  const auto start = std::chrono::steady_clock::now();
  const std::clock_t cpu = std::clock();
  work();
  spent.cpu_ms += 1e3 * double(std::clock() - cpu) / CLOCKS_PER_SEC;
  spent.wall_ms +=
      std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
}

// The field, its inverse and the sampling against the sampling alone, in turns.
void BM_PoseAgainstItk(benchmark::State& state) {
  const Subject& subject = TheSubject();
  const Grid& grid = subject.image().grid;
  const ResolvedPose pose = subject.Pose(1);
  ItkWarp warp(subject.image(), TemplateFromPosed(subject, pose, grid), 2);
  PosedVolume out;
  subject.engine->PoseInto(out, pose, grid);
  Spent ours, itks;
  for (auto _ : state) {
    Spend(itks, [&] { benchmark::DoNotOptimize(warp.Run()); });
    const double before = ours.wall_ms;
    Spend(ours, [&] { subject.engine->PoseInto(out, pose, grid); });
    state.SetIterationTime(1e-3 * (ours.wall_ms - before));
  }
  state.counters["cpu_ms"] = ours.cpu_ms / double(state.iterations());
  state.counters["itk_ms"] = itks.wall_ms / double(state.iterations());
  state.counters["itk_cpu_ms"] = itks.cpu_ms / double(state.iterations());
  state.counters["of_itk"] = ours.wall_ms / itks.wall_ms;
  state.counters["cpu_of_itk"] = ours.cpu_ms / itks.cpu_ms;
  state.SetLabel(SharedDevice().device_name());
}
BENCHMARK(BM_PoseAgainstItk)->Unit(benchmark::kMillisecond)->UseManualTime()->MinTime(3);

void BM_Batch(benchmark::State& state) {
  const Subject& subject = TheSubject();
  PosedVolume out;
  for (auto _ : state)
    for (int n = 0; n < kBatch; ++n) subject.engine->PoseInto(out, subject.Pose(double(n) / kBatch));
  state.SetItemsProcessed(int64_t(state.iterations()) * kBatch);
  state.SetLabel(SharedDevice().device_name());
}
BENCHMARK(BM_Batch)->Unit(benchmark::kMillisecond)->UseRealTime()->MeasureProcessCPUTime();

// Each in a pose that was not asked for before, or from another side of the same.
void BM_Plane(benchmark::State& state) {
  const Subject& subject = TheSubject();
  const bool same_pose = state.range(0) != 0;
  SliceRequest request;
  request.axis = SliceAxis(state.range(1));
  int n = 0;
  for (auto _ : state) {
    const ResolvedPose pose = subject.Pose(same_pose ? 1 : 0.5 + 0.01 * (n++ % 50));
    benchmark::DoNotOptimize(PosedSlice(*subject.engine, pose, request));
  }
  state.SetLabel(SharedDevice().device_name());
}
BENCHMARK(BM_Plane)
    ->ArgNames({"same_pose", "axis"})
    ->ArgsProduct({{0, 1}, {0, 1, 2}})
    ->Unit(benchmark::kMillisecond)
    ->UseRealTime()
    ->MeasureProcessCPUTime();

void PoseAShape(benchmark::State& state, const HandShape& shape) {
  const HandLike hand(shape);
  const PosingEngine engine(SharedDevice(), hand.Inputs());
  const ResolvedPose pose = hand.Pose(kBend);
  PosedVolume out;
  engine.PoseInto(out, pose, hand.grid);
  for (auto _ : state) engine.PoseInto(out, pose, hand.grid);
  state.counters["voxels"] = double(hand.grid.VoxelCount());
  state.counters["tissue"] = double(std::count(hand.body.values.begin(), hand.body.values.end(), 1));
  state.counters["examples"] = shape.examples;
}

void BM_GrowVoxels(benchmark::State& state) { PoseAShape(state, {.scale = 0.01 * double(state.range(0))}); }
void BM_GrowTissue(benchmark::State& state) { PoseAShape(state, {.fingers = int(state.range(0))}); }
void BM_GrowExamples(benchmark::State& state) { PoseAShape(state, {.examples = int(state.range(0))}); }
BENCHMARK(BM_GrowVoxels)->Arg(50)->Arg(63)->Arg(79)->Arg(90)->Arg(100)->MeasureProcessCPUTime()->MinTime(1);
BENCHMARK(BM_GrowTissue)->DenseRange(1, 5)->MeasureProcessCPUTime()->MinTime(1);
BENCHMARK(BM_GrowExamples)
    ->Arg(0)
    ->Arg(1)
    ->Arg(2)
    ->Arg(5)
    ->Arg(10)
    ->Arg(20)
    ->MeasureProcessCPUTime()
    ->MinTime(1);

}  // namespace
}  // namespace kvx
