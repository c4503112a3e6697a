// Ports for tests of the API and the server: what they answer can be worked out on paper.
#pragma once
#include <atomic>
#include <condition_variable>
#include <fstream>
#include <mutex>

#include "api/ports.h"
#include "core/errors.h"

namespace kvx::testing_support {

// Accepts files that start with "VOXELS"; a folder is a scan of as many slices as it holds files.
class FakeInspector final : public ScanInspector {
 public:
  ScanFacts InspectScan(const std::filesystem::path& path) override {
    ScanFacts facts;
    facts.grid.size = {4, 5, 6};
    facts.modality = "MR";
    facts.stored_as = ScalarType::kInt16;
    if (std::filesystem::is_directory(path)) {
      facts.grid.size.z() = int(std::distance(std::filesystem::directory_iterator(path), {}));
      return facts;
    }
    std::string start(6, '\0');
    std::ifstream(path, std::ios::binary).read(start.data(), 6);
    if (start != "VOXELS") throw InputError("the file is not a readable volume");
    return facts;
  }
  std::atomic<bool> background_alone{false};  // of what comes as labels
  LabelFacts InspectLabels(const std::filesystem::path& path, const std::string& region) override {
    LabelFacts facts{InspectScan(path).grid, {1, 2}, {}};
    if (background_alone) facts.labels = {255};
    for (const int label : facts.labels) facts.bones.push_back({label, 10, 0.1, {}, region, "", 1, ""});
    return facts;
  }
};

// A build takes `stages` reports and can be held at one of them.
class FakeBuilder final : public ModelBuilder {
 public:
  int stages = 3;
  std::atomic<int> builds{0};
  std::atomic<int> fail_first{0};   // that many builds are Unavailable
  std::atomic<bool> refuse{false};  // Check throws InputError
  std::atomic<bool> deaf{false};    // held, it does not look whether somebody wants it to stop

  void Check(const BuildTask&) override {
    if (refuse) throw InputError("joints: there is no bone of this name");
  }
  BuildOutcome Build(const BuildTask& task, const Progress& progress) override {
    ++builds;
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
    if (refuse) throw InputError(task.strokes ? "the strokes lie outside the scan" : "this scan is no CT");
  }
  // A label map is what it was made of.
  SegmentOutcome Segment(const SegmentTask& task, const std::filesystem::path& out, const Progress& progress) override {
    Build({task.region, "", {}, {}}, progress);
    std::ofstream(out, std::ios::binary) << "VOXELS of " << (task.strokes ? task.strokes->name : "threshold");
    return {{{}, {1}, {{1, 10, 0.1, {}, "femur", "", 0.9, ""}}}, {"bone 1: check it"}};
  }
  void ConvertLabels(const StudyFile& labels, const std::filesystem::path& out) override {
    std::ofstream(out, std::ios::binary) << labels.name << " as " << out.extension().string();
  }
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

// Points move by the angle of "tibia.flexion" in degrees along x; a volume is a text of its query.
class FakePoser final : public ModelPoser {
 public:
  std::atomic<int> volumes{0}, animations_checked{0};

  PoseRequest ParsePose(std::string_view json) override {
    if (json.find("tibia.flexion") == json.npos) throw InputError("joints: missing");
    return AnglePose{{{"tibia.flexion", RadFromDeg(35)}}};
  }
  std::string InfoJson(const std::string&) override { return R"({"version":"x","template":"pose00"})"; }
  Digest PoseDigest(const PosedQuery& query) override {
    return Hasher().Add(query.model).Add(Degrees(query)).Add(int64_t(query.mode)).Add(int64_t(query.level)).Finish();
  }
  void WriteVolume(const PosedQuery& query, VolumeFormat, const std::filesystem::path& path) override {
    ++volumes;
    std::ofstream(path, std::ios::binary) << Content(Degrees(query));
  }
  std::string RawVolume(const PosedQuery& query) override {
    ++volumes;
    Degrees(query);
    Grid grid;
    grid.size = {2, 1, 1};
    return RawHeader(grid, ScalarType::kUint8) + "ab";
  }
  std::string Field(const PosedQuery& query) override {
    Degrees(query);
    Grid grid;
    grid.size = {2, 1, 1};
    return FieldHeader(grid, {2.5, 1, 0.25}) + std::string(24, char('0' + query.level));
  }
  void WriteSlice(const PosedQuery& query, const SliceView& view, SliceFormat, const std::filesystem::path& path) override {
    std::ofstream(path, std::ios::binary) << "slice " << view.axis << " " << view.at_mm.value_or(-1) << " " << Degrees(query);
  }
  std::string Surface(const PosedQuery& query, const SurfaceParts& parts, SurfaceFormat format) override {
    for (const std::string& bone : parts.bones) {
      if (bone != "tibia") throw NotFound("there is no bone of this name; there is tibia");
    }
    return (format == SurfaceFormat::kGlb ? "glTF " : "STL ") + std::to_string(parts.bones.size()) + std::to_string(Degrees(query));
  }
  AnimationFacts CheckAnimation(const AnimationTask& task) override {
    ++animations_checked;
    if (task.key_frames.find("frames") == task.key_frames.npos) throw InputError("frames is missing");
    return {3, Hasher().Add(task.key_frames).Add(task.format).Add(int64_t(task.level)).Finish()};
  }
  std::filesystem::path results;  // set by the world
  void WriteAnimation(const AnimationTask& task, const std::string& name, const Progress& progress) override {
    progress.Report("frames", 0.5);
    std::ofstream(results / name, std::ios::binary) << "three frames as " << task.format;
  }
  std::vector<PointMm> MapPoints(const PosedQuery& query, const std::vector<PointMm>& points) override {
    std::vector<PointMm> moved = points;
    for (PointMm& p : moved) p.lps.x() += Degrees(query);
    return moved;
  }

  // Long enough that ranges and several chunks matter.
  static std::string Content(double degrees) {
    std::string text;
    while (text.size() < 300'000) text += std::to_string(degrees) + " degrees " + std::to_string(text.size()) + "\n";
    return text;
  }

 private:
  static double Degrees(const PosedQuery& query) {
    const auto* angles = std::get_if<AnglePose>(&query.pose);
    if (!angles) return 0;
    double degrees = 0;
    for (const auto& [name, rad] : angles->angles_rad) {
      if (name != "tibia.flexion") throw NotFound("there is no joint angle of this name; there is tibia.flexion");
      degrees = std::round(DegFromRad(rad) * 1e6) / 1e6;
    }
    return degrees;
  }
};

}  // namespace kvx::testing_support
