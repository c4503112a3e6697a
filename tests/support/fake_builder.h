// A builder that can be held, refuse and fail.
#pragma once
#include <atomic>
#include <condition_variable>
#include <fstream>
#include <mutex>
#include <thread>

#include "api/builder_port.h"
#include "api/poser_port.h"
#include "core/errors.h"
#include "tests/support/meanwhile.h"

namespace kvx::testing_support {

// A build takes `stages` reports and can be held at one of them.
class FakeBuilder final : public ModelBuilder {
 public:
  int stages = 3;
  std::atomic<int> builds{0};
  std::atomic<int> fail_first{0};                      // that many builds are Unavailable
  std::atomic<int> converting{0}, most_converting{0};  // label maps at the same time
  std::atomic<int> checking{0}, most_checking{0};      // strokes and thresholds at the same time
  std::atomic<bool> refuse{false};                     // Check throws InputError
  std::string conversion = "1";
  std::atomic<bool> deaf{false};  // held, it does not look whether somebody wants it to stop
  Meanwhile meanwhile;            // while the next task is checked
  Meanwhile beginning;            // of the next build

  void Check(const BuildTask&) override {
    meanwhile.Happen();
    if (refuse) throw InputError("joints: there is no bone of this name");
  }
  BuildOutcome Build(const BuildTask& task, const Progress& progress) override {
    ++builds;
    beginning.Happen();
    if (fail_first-- > 0) throw Unavailable("the device is busy");
    for (int stage = 0; stage < stages; ++stage) {
      progress.Report("stage" + std::to_string(stage), double(stage) / stages);
      std::unique_lock lock(mutex_);
      // Held: goes on reporting, as a long stage does, so that a wish to stop is seen.
      while (held_) {
        opened_.wait_for(lock, std::chrono::milliseconds(10));
        if (deaf) continue;
        lock.unlock();
        progress.Report("stage" + std::to_string(stage), double(stage) / stages);
        lock.lock();
      }
    }
    return {Sha256(task.study).Hex(), {"scan b, bone tibia: doubtful"}};
  }
  void CheckSegment(const SegmentTask& task) override {
    const int now = ++checking;
    if (now > most_checking) most_checking = now;
    std::this_thread::sleep_for(std::chrono::milliseconds(5));
    --checking;
    meanwhile.Happen();
    if (refuse) throw InputError(task.strokes ? "the strokes lie outside the scan" : "this scan is no CT");
  }
  // A label map is what it was made of.
  SegmentOutcome Segment(const SegmentTask& task, const std::filesystem::path& out,
                         const Progress& progress) override {
    Build({task.region, "", {}, {}}, progress);
    std::ofstream(out, std::ios::binary) << "VOXELS of " << (task.strokes ? task.strokes->name : "threshold")
                                         << (task.previous ? " after " + task.previous->name : "");
    return {{{}, {1}, {{1, 10, 0.1, {}, "femur", "", 0.9, ""}}}, {"bone 1: check it"}};
  }
  void ConvertLabels(const StudyFile& labels, const std::filesystem::path& out) override {
    const int now = ++converting;
    if (now > most_converting) most_converting = now;
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    std::ofstream(out, std::ios::binary) << labels.name << " as " << out.extension().string();
    --converting;
  }
  // A raw scan is two voxels.
  void ConvertScan(const StudyFile& scan, const std::filesystem::path& out) override {
    if (out.extension() != ".raw") return ConvertLabels(scan, out);
    Grid grid;
    grid.size = {2, 1, 1};
    std::ofstream(out, std::ios::binary) << RawHeader(grid, ScalarType::kUint8) << "ab";
  }
  std::string ConversionVersion() const override { return conversion; }
  void Hold() { Set(true); }
  void Open() { Set(false); }

 private:
  void Set(bool held) {
    {
      const std::lock_guard lock(mutex_);
      held_ = held;
    }
    opened_.notify_all();
  }
  std::mutex mutex_;
  std::condition_variable opened_;
  bool held_ = false;
};

}  // namespace kvx::testing_support
