// The API's ports filled with the pipeline: reading uploads, building models, posing them.
#pragma once
#include <list>
#include <mutex>
#include <semaphore>

#include "api/ports.h"
#include "kernels/device/backend.h"
#include "pipeline/model/model.h"
#include "server/turns/posing_gate.h"
#include "storage/files/data_folder.h"

namespace kvx {

class PipelineInspector final : public ScanInspector {
 public:
  ScanFacts InspectScan(const std::filesystem::path& file_or_folder, const std::string& project) override;
  LabelFacts InspectLabels(const std::filesystem::path& file, const std::string& region,
                           const std::string& project) override;
};
LabelFacts FactsOf(const LabelMap& labels, std::vector<ProposedBone> bones);

// One backend per build that runs at the same time: their queues do not meet.
class PipelineBuilder final : public ModelBuilder {
 public:
  PipelineBuilder(const DataFolder& data, BackendOptions options)
      : data_(data), options_(std::move(options)) {}
  void Check(const BuildTask& task) override;
  BuildOutcome Build(const BuildTask& task, const Progress& progress) override;
  void CheckSegment(const SegmentTask& task) override;
  SegmentOutcome Segment(const SegmentTask& task, const std::filesystem::path& out,
                         const Progress& progress) override;
  void ConvertLabels(const StudyFile& labels, const std::filesystem::path& out) override;
  void ConvertScan(const StudyFile& scan, const std::filesystem::path& out) override;
  std::string ConversionVersion() const override;

 private:
  std::unique_ptr<Backend> TakeBackend();
  void ReturnBackend(std::unique_ptr<Backend> backend);
  const DataFolder& data_;
  BackendOptions options_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<Backend>> idle_;
};

// Keeps the models posed last, on a backend of its own. Thread-safe.
class PipelinePoser final : public ModelPoser {
 public:
  PipelinePoser(const DataFolder& data, const BackendOptions& options);
  ~PipelinePoser() override;
  int64_t device_memory_bytes() const;
  bool DeviceWorks() const;  // takes a few bytes there and back
  bool DeviceHasRoom() const override;

  PoseRequest ParsePose(std::string_view json) override;
  std::string InfoJson(const std::string& model) override;
  PoseFacts FactsOf(const PosedQuery& query) override;
  void Forget(const std::string& model) override;
  void Sweep() override;
  void WriteVolume(const PosedQuery& query, VolumeFormat format, const std::filesystem::path& path) override;
  void WriteDicom(const PosedQuery& query, const DicomNames& names,
                  const std::filesystem::path& path) override;
  std::string RawVolume(const PosedQuery& query) override;
  std::string Field(const PosedQuery& query) override;
  void WriteRegistration(const std::string& model, const std::string& scan, RegistrationMap map,
                         const std::filesystem::path& path, const Asker& asker) override;
  std::string WriteSlice(const PosedQuery& query, const SliceRequest& view, SliceFormat format,
                         const std::filesystem::path& path) override;
  std::string Surface(const PosedQuery& query, const SurfaceParts& parts, SurfaceFormat format) override;
  AnimationFacts CheckAnimation(const AnimationTask& task) override;
  void WriteAnimation(const AnimationTask& task, const std::string& name, const Progress& progress) override;
  bool HasAnimation(const std::string& name) const override;
  std::vector<PointMm> MapPoints(const PosedQuery& query, const std::vector<PointMm>& in_template) override;

 private:
  struct Loaded;
  struct Slot;
  struct Posing;
  std::shared_ptr<Slot> SlotOf(const std::string& model);
  std::shared_ptr<Loaded> Require(const std::string& model);
  PosingEngine& EngineOf(Loaded& loaded);
  Posing Begin(const PosedQuery& query);  // waits at the gate

  const DataFolder& data_;
  std::unique_ptr<Backend> backend_;
  PosingGate gate_;
  PosingGate field_gate_;  // before the other: fields take minutes, and must not have all of its slots
  std::mutex mutex_;
  std::list<std::shared_ptr<Slot>> recent_;  // used last first
  std::counting_semaphore<> loading_{2};
};

}  // namespace kvx
