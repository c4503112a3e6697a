// Posing for requests: a few models stay loaded, their examples on the device.
#include <cmath>
#include <fstream>

#include "core/errors.h"
#include "pipeline/io/volume_file.h"
#include "pipeline/model/info.h"
#include "pipeline/model/study_file.h"
#include "server/pipeline_ports.h"
#include "server/sweep_artifacts.h"

namespace kvx {
namespace {

constexpr size_t kModelsKept = 2;  // a model's examples fill hundreds of megabytes

DeformationMode ModeOf(PosingMode mode) {
  return mode == PosingMode::kEvd ? DeformationMode::kEvd : DeformationMode::kVbd;
}

template <class T>
std::string AsBytes(const std::vector<float>& values) {
  std::string bytes(values.size() * sizeof(T), '\0');
  for (size_t i = 0; i < values.size(); ++i) {
    double value = values[i];
    if constexpr (std::is_integral_v<T>) {
      constexpr double kLeast = double(std::numeric_limits<T>::min()), kMost = double(std::numeric_limits<T>::max());
      value = std::clamp(std::nearbyint(value), kLeast, kMost);
    }
    const T stored = T(value);
    std::memcpy(&bytes[i * sizeof(T)], &stored, sizeof(T));
  }
  return bytes;
}

std::string RawBytes(const std::vector<float>& values, ScalarType type) {
  switch (type) {
    case ScalarType::kUint8: return AsBytes<uint8_t>(values);
    case ScalarType::kInt8: return AsBytes<int8_t>(values);
    case ScalarType::kUint16: return AsBytes<uint16_t>(values);
    case ScalarType::kInt16: return AsBytes<int16_t>(values);
    case ScalarType::kUint32: return AsBytes<uint32_t>(values);
    case ScalarType::kInt32: return AsBytes<int32_t>(values);
    case ScalarType::kFloat32: return AsBytes<float>(values);
    case ScalarType::kFloat64: return AsBytes<double>(values);
  }
  throw std::logic_error("a scalar type is missing here");
}

void WriteRaw(const std::filesystem::path& path, const Volume& volume, ScalarType type) {
  std::ofstream out(path, std::ios::binary);
  out << RawHeader(volume.grid, type) << RawBytes(volume.values, type);
  out.close();
  if (!out) throw Unavailable("the posed volume cannot be stored; is the disk full?");
}

void AddTransform(Hasher& hasher, const RigidTransform& b_from_a) {
  for (const double number : RowMajor(b_from_a)) hasher.Add(number == 0 ? 0.0 : number);  // -0 is 0
}

}  // namespace

struct PipelinePoser::Loaded {
  std::string id;
  Model model;
  std::mutex mutex;
  std::unique_ptr<PosingEngine> engine;  // made at the first pose
};

PipelinePoser::PipelinePoser(const DataFolder& data, const BackendOptions& options)
    : data_(data), backend_(std::make_unique<Backend>(options)) {}
PipelinePoser::~PipelinePoser() = default;

const std::string& PipelinePoser::device_name() const { return backend_->device_name(); }

int64_t PipelinePoser::device_memory_bytes() const {
  return int64_t(backend_->device().getInfo<CL_DEVICE_GLOBAL_MEM_SIZE>());
}

bool PipelinePoser::DeviceWorks() const try {
  cl::CommandQueue queue = backend_->NewQueue();
  const cl_int sent = 0x5A17;
  cl_int back = 0;
  const cl::Buffer buffer(backend_->context(), CL_MEM_READ_WRITE, sizeof sent);
  queue.enqueueWriteBuffer(buffer, CL_TRUE, 0, sizeof sent, &sent);
  queue.enqueueReadBuffer(buffer, CL_TRUE, 0, sizeof back, &back);
  return back == sent;
} catch (const cl::Error&) {
  return false;
}

PoseRequest PipelinePoser::ParsePose(std::string_view json) { return kvx::ParsePose(json); }

// Loading under the lock: two requests for one model must not load it twice.
std::shared_ptr<PipelinePoser::Loaded> PipelinePoser::Require(const std::string& id) {
  const std::lock_guard lock(mutex_);
  for (auto it = recent_.begin(); it != recent_.end(); ++it) {
    if ((*it)->id != id) continue;
    recent_.splice(recent_.begin(), recent_, it);
    return recent_.front();
  }
  recent_.push_front(
      std::shared_ptr<Loaded>(new Loaded{id, Model::Load(data_.Model(id), data_.artifacts()), {}, nullptr}));
  if (recent_.size() > kModelsKept) recent_.pop_back();
  return recent_.front();
}

PosingEngine& PipelinePoser::EngineOf(Loaded& loaded) {
  const std::lock_guard lock(loaded.mutex);
  if (!loaded.engine) loaded.engine = loaded.model.MakeEngine(*backend_);
  return *loaded.engine;
}

void PipelinePoser::Forget(const std::string& model) {
  {
    const std::lock_guard lock(mutex_);
    recent_.remove_if([&](const auto& loaded) { return loaded->id == model; });
  }
  std::error_code error;
  std::filesystem::remove_all(data_.Model(model), error);
  if (error) throw Unavailable("files of a removed model cannot be removed now; it is tried again at the next start");
  WantSweep(data_);
  SweepArtifacts(data_);
}

std::string PipelinePoser::InfoJson(const std::string& model) { return kvx::InfoJson(Require(model)->model); }

Digest PipelinePoser::PoseDigest(const PosedQuery& query) {
  const auto loaded = Require(query.model);
  const ResolvedPose pose = loaded->model.Resolve(query.pose, ModeOf(query.mode));
  Hasher hasher;
  hasher.Add("posed volume").Add(KVX_VERSION).Add(loaded->model.manifest().ContentDigest());
  hasher.Add(int64_t(query.mode)).Add(int64_t(query.level));
  for (const RigidTransform& bone : pose.scan_from_template) AddTransform(hasher, bone);
  for (const float coefficient : pose.coefficients.reshaped()) hasher.Add(double(coefficient));
  return hasher.Finish();
}

void PipelinePoser::WriteVolume(const PosedQuery& query, VolumeFormat format, const std::filesystem::path& path) {
  const auto loaded = Require(query.model);
  const ResolvedPose pose = loaded->model.Resolve(query.pose, ModeOf(query.mode));
  const PosedVolume posed = EngineOf(*loaded).Pose(pose, {}, query.level);
  const ScalarType type = loaded->model.template_scan().stored_as;
  if (format == VolumeFormat::kRaw) return WriteRaw(path, posed.volume, type);
  kvx::WriteVolume(path, posed.volume, type);
}

std::vector<PointMm> PipelinePoser::MapPoints(const PosedQuery& query, const std::vector<PointMm>& in_template) {
  const auto loaded = Require(query.model);
  return EngineOf(*loaded).MapPoints(loaded->model.Resolve(query.pose, ModeOf(query.mode)), in_template);
}

}  // namespace kvx
