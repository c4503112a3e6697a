// A poser whose answers can be worked out on paper.
#pragma once
#include <atomic>
#include <chrono>
#include <fstream>
#include <functional>
#include <thread>

#include "api/poser_port.h"
#include "core/errors.h"
#include "tests/support/meanwhile.h"

namespace kvx::testing_support {

// Points move by the angle of "tibia.flexion" in degrees along x; a volume is a text of its query.
class FakePoser final : public ModelPoser {
 public:
  std::atomic<int> volumes{0}, animations_checked{0}, animations{0};
  Meanwhile meanwhile;                                                 // while the next animation is checked
  std::function<void()> while_parsing = [] {}, while_mapping = [] {};  // a pose, a list of points
  std::atomic<bool> held{false};                                       // fields are not made ...
  std::atomic<int> fields{0}, fields_given_up{0};                      // ... until nobody waits for them

  std::atomic<bool> device_has_room{true};
  std::atomic<int> forgotten{0}, sweeps{0};

  void Forget(const std::string&) override { ++forgotten; }
  void Sweep() override { ++sweeps; }
  bool DeviceHasRoom() const override { return device_has_room; }
  PoseRequest ParsePose(std::string_view json) override {
    while_parsing();
    if (json.find("tibia.flexion") == json.npos) throw InputError("joints: missing");
    return AnglePose{{{"tibia.flexion", RadFromDeg(35)}}};
  }
  std::string InfoJson(const std::string&) override { return R"({"version":"x","template":"pose00"})"; }
  PoseFacts FactsOf(const PosedQuery& query) override {
    const Digest digest = Hasher()
                              .Add(query.model)
                              .Add(Degrees(query))
                              .Add(int64_t(query.mode))
                              .Add(int64_t(query.level))
                              .Add(int64_t(query.labels))
                              .Finish();
    const bool as_in_a_scan = std::holds_alternative<ScanPose>(query.pose);
    return {digest, std::max(0.0, Degrees(query) - 80) / 20, as_in_a_scan ? "lost" : "",
            Sha256(as_in_a_scan ? "a scan's world" : "the template's")};
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
    return RawHeader(grid, ScalarType::kUint8) + (query.labels ? "\1\2" : "ab");
  }
  void WriteDicom(const PosedQuery& query, const DicomNames& names,
                  const std::filesystem::path& path) override {
    ++volumes;
    std::ofstream(path, std::ios::binary)
        << "series of " << names.patient_id << " as " << names.modality << " " << Degrees(query);
  }
  std::string Field(const PosedQuery& query) override {
    Degrees(query);
    ++fields;
    while (held && !query.asker.HasGone()) std::this_thread::sleep_for(std::chrono::milliseconds(5));
    if (query.asker.HasGone()) {
      ++fields_given_up;
      throw Cancelled();
    }
    Grid grid;
    grid.size = {2, 1, 1};
    return FieldHeader(grid, {2.5, 1, 0.25}) + std::string(24, char('0' + query.level));
  }
  void WriteRegistration(const std::string&, const std::string& scan, RegistrationMap map,
                         const std::filesystem::path& path, const Asker& asker) override {
    if (asker.HasGone()) throw Cancelled();
    if (scan != "pose01") throw NotFound("there is no scan of this name; there is pose01");
    std::ofstream(path, std::ios::binary) << "map " << int(map) << " of " << scan;
  }
  // Of 4 x 3 pixels of half a millimetre, the first at (1, 2, mm).
  std::string WriteSlice(const PosedQuery& query, const SliceRequest& view, SliceFormat format,
                         const std::filesystem::path& path) override {
    std::ofstream(path, std::ios::binary)
        << "slice " << NameOf(view.Axis()) << " " << view.at_mm.value_or(-1) << " " << Degrees(query);
    Grid grid;
    grid.size = {4, 3, 1};
    grid.spacing_mm.setConstant(0.5);
    grid.origin.lps = {1, 2, view.at_mm.value_or(-1)};
    if (format != SliceFormat::kPng) return SliceHeader(grid, ScalarType::kInt16, {});
    return SliceHeader(grid, ScalarType::kUint8, view.window.value_or(std::pair(10.0, 200.0)));
  }
  std::string Surface(const PosedQuery& query, const SurfaceParts& parts, SurfaceFormat format) override {
    for (const std::string& bone : parts.bones) {
      if (bone != "tibia") throw NotFound("there is no bone of this name; there is tibia");
    }
    const std::string skin = !parts.skin ? "" : *parts.skin ? "skin " : "no skin ";
    return (format == SurfaceFormat::kGlb ? "glTF " : "STL ") + skin + std::to_string(parts.bones.size()) +
           std::to_string(Degrees(query));
  }
  AnimationFacts CheckAnimation(const AnimationTask& task) override {
    ++animations_checked;
    meanwhile.Happen();
    if (task.key_frames.find("frames") == task.key_frames.npos) throw InputError("frames is missing");
    return {3, Hasher().Add(task.key_frames).Add(task.format).Add(int64_t(task.view.level)).Finish()};
  }
  std::filesystem::path results;  // set by the world
  void WriteAnimation(const AnimationTask& task, const std::string& name, const Progress& progress) override {
    ++animations;
    progress.Report("frames", 0.5);
    std::ofstream(results / name, std::ios::binary) << "three frames as " << task.format;
  }
  bool HasAnimation(const std::string& name) const override {
    return std::filesystem::exists(results / name);
  }
  std::vector<PointMm> MapPoints(const PosedQuery& query, const std::vector<PointMm>& points) override {
    while_mapping();
    if (query.asker.HasGone()) throw Cancelled();
    std::vector<PointMm> moved = points;
    for (PointMm& p : moved) p.lps.x() += Degrees(query);
    return moved;
  }

  // Long enough that ranges and several chunks matter.
  static std::string Content(double degrees) {
    std::string text;
    while (text.size() < 300'000)
      text += std::to_string(degrees) + " degrees " + std::to_string(text.size()) + "\n";
    return text;
  }

 private:
  static double Degrees(const PosedQuery& query) {
    const auto* angles = std::get_if<AnglePose>(&query.pose);
    if (!angles) return 0;
    double degrees = 0;
    for (const auto& [name, rad] : angles->angles_rad) {
      if (name != "tibia.flexion")
        throw NotFound("there is no joint angle of this name; there is tibia.flexion");
      degrees = std::round(DegFromRad(rad) * 1e6) / 1e6;
    }
    return degrees;
  }
};

}  // namespace kvx::testing_support
