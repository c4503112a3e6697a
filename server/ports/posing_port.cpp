// Posing for requests: a few models stay loaded, their examples on the device.
#include <cmath>

#include "api/handlers/slice_query.h"
#include "core/errors.h"
#include "core/version.h"
#include "pipeline/io/sequence_file.h"
#include "pipeline/io/surface_file.h"
#include "pipeline/io/video_file.h"
#include "pipeline/io/volume_file.h"
#include "pipeline/io/voxel_values.h"
#include "pipeline/model/files/motion_file.h"
#include "pipeline/model/files/pose_file.h"
#include "pipeline/model/info.h"
#include "pipeline/model/map_from_scan.h"
#include "pipeline/model/posed_series.h"
#include "pipeline/model/scan_verdict.h"
#include "pipeline/posing/animation.h"
#include "pipeline/posing/inverse_grid.h"
#include "pipeline/posing/posed_surfaces.h"
#include "server/ports/animation_limits.h"
#include "server/ports/pipeline_ports.h"
#include "server/sweep_artifacts.h"

namespace kvx {
namespace {

constexpr size_t kModelsKept = 2;  // a model's examples fill hundreds of megabytes
constexpr int kPosingAtOnce = 2;   // one on the device, the other reads back, packs or compresses
constexpr int kFieldsAtOnce = 1;   // the other may pose
constexpr int kMostWaiting = 64;   // of one project alone; more get 503
constexpr size_t kSpareGrids = 2;  // of the template's size: what a larger pose needed is not kept

bool IsVideo(const AnimationTask& task) { return task.format == "mp4" || task.format == "webm"; }

// Requests for many models load a few at a time.
class LoadingTurn {
 public:
  explicit LoadingTurn(std::counting_semaphore<>& turns) : turns_(turns) { turns_.acquire(); }
  ~LoadingTurn() { turns_.release(); }
  LoadingTurn(const LoadingTurn&) = delete;
  LoadingTurn& operator=(const LoadingTurn&) = delete;

 private:
  std::counting_semaphore<>& turns_;
};

// Of a posed grid over HTTP: a few bytes must not ask for gigabytes. Bent limbs need a few times the
// template.
double MostVoxels(const Grid& of_template) {
  constexpr double kTemplates = 16, kAlways = 64e6;
  return std::min(PosingEngine::kMostVoxels,
                  std::max(kAlways, kTemplates * double(of_template.VoxelCount())));
}

void AddTransform(Hasher& hasher, const RigidTransform& b_from_a) {
  for (const double number : RowMajor(b_from_a)) hasher.Add(number == 0 ? 0.0 : number);  // -0 is 0
}

}  // namespace

struct PipelinePoser::Loaded {
  explicit Loaded(Model m) : model(std::move(m)) {}
  Model model;
  std::mutex mutex;
  std::unique_ptr<PosingEngine> engine;  // made at the first pose
  TemplateSurfaces surfaces{model.bones(), model.body()};
  Window window = WindowOf(model.template_scan().volume);
  std::vector<PosedVolume> spare;  // memory of posed volumes to use again, one for each that poses at a time

  PosedVolume TakeSpare() {
    const std::lock_guard lock(mutex);
    if (spare.empty()) return {};
    PosedVolume taken = std::move(spare.back());
    spare.pop_back();
    return taken;
  }
  void KeepSpare(PosedVolume posed) {
    if (posed.volume.values.capacity() > kSpareGrids * model.template_scan().volume.grid.VoxelCount()) return;
    const std::lock_guard lock(mutex);
    spare.push_back(std::move(posed));
  }
};

// What every product of a pose begins with. Let go of in the end: the gate, then the model.
// Those who wait at the gate hold no model yet.
struct PipelinePoser::Posing {
  Posing(PipelinePoser& poser, const PosedQuery& query)
      : pass(poser.gate_, query.asker),
        loaded(poser.Require(query.model)),
        pose(loaded->model.Resolve(query.pose, query.mode)),
        engine(poser.EngineOf(*loaded)) {}

  PosingGate::Pass pass;
  std::shared_ptr<Loaded> loaded;
  ResolvedPose pose;
  PosingEngine& engine;
};

// A place for a model among those kept; what is in it is loaded by whoever needs it first.
struct PipelinePoser::Slot {
  explicit Slot(std::string i) : id(std::move(i)) {}
  const std::string id;
  std::mutex mutex;
  std::shared_ptr<Loaded> loaded;
};

PipelinePoser::PipelinePoser(const DataFolder& data, const BackendOptions& options)
    : data_(data),
      backend_(std::make_unique<Backend>(options)),
      gate_(kPosingAtOnce, kMostWaiting),
      field_gate_(kFieldsAtOnce, kMostWaiting) {}
PipelinePoser::~PipelinePoser() = default;

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

bool PipelinePoser::DeviceHasRoom() const { return backend_->HasRoom(); }

PoseRequest PipelinePoser::ParsePose(std::string_view json) { return kvx::ParsePose(json); }

std::shared_ptr<PipelinePoser::Slot> PipelinePoser::SlotOf(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const auto found = std::ranges::find_if(recent_, [&](const auto& slot) { return slot->id == id; });
  if (found != recent_.end()) {
    recent_.splice(recent_.begin(), recent_, found);
  } else {
    recent_.push_front(std::make_shared<Slot>(id));
    if (recent_.size() > kModelsKept) recent_.pop_back();
  }
  return recent_.front();
}

// Loading under the slot's lock: two requests for one model load it once, and others do not wait for it.
std::shared_ptr<PipelinePoser::Loaded> PipelinePoser::Require(const std::string& id) try {
  const auto slot = SlotOf(id);
  const std::lock_guard lock(slot->mutex);
  if (!slot->loaded) {
    const LoadingTurn turn(loading_);
    slot->loaded = std::make_shared<Loaded>(Model::Load(data_.Model(id), data_.artifacts()));
  }
  return slot->loaded;
} catch (...) {
  const std::lock_guard lock(mutex_);
  recent_.remove_if([&](const auto& slot) { return slot->id == id; });
  throw;
}

PosingEngine& PipelinePoser::EngineOf(Loaded& loaded) {
  const std::lock_guard lock(loaded.mutex);
  if (!loaded.engine)
    loaded.engine = loaded.model.MakeEngine(*backend_, MostVoxels(loaded.model.template_scan().volume.grid));
  return *loaded.engine;
}

PipelinePoser::Posing PipelinePoser::Begin(const PosedQuery& query) { return Posing(*this, query); }

void PipelinePoser::Forget(const std::string& model) {
  {
    const std::lock_guard lock(mutex_);
    recent_.remove_if([&](const auto& slot) { return slot->id == model; });
  }
  std::error_code error;
  std::filesystem::remove_all(data_.Model(model), error);
  if (error)
    throw Unavailable("files of a removed model cannot be removed now; it is tried again within the hour");
  WantSweep(data_);
}

void PipelinePoser::Sweep() { SweepArtifacts(data_); }

std::string PipelinePoser::InfoJson(const std::string& model) { return kvx::InfoJson(Require(model)->model); }

PoseFacts PipelinePoser::FactsOf(const PosedQuery& query) {
  const auto loaded = Require(query.model);
  const ResolvedPose pose = loaded->model.Resolve(query.pose, query.mode);
  Hasher hasher;
  hasher.Add("posed volume")
      .Add(ProgramVersion())
      .Add(int64_t(PosingEngine::kVersion))
      .Add(loaded->model.manifest().ContentDigest());
  hasher.Add(int64_t(query.mode)).Add(int64_t(query.level)).Add(query.labels ? "labels" : "intensities");
  for (const RigidTransform& bone : pose.scan_from_template) AddTransform(hasher, bone);
  for (const float coefficient : pose.coefficients.reshaped()) hasher.Add(double(coefficient));
  PoseFacts facts{
      hasher.Finish(), LargestExtrapolation(pose), {}, WorldOf(loaded->model.manifest(), query.pose)};
  if (const auto* as_in = std::get_if<ScanPose>(&query.pose))
    facts.scan_verdict = NameOf(VerdictOf(loaded->model, as_in->scan).kind);
  return facts;
}

void PipelinePoser::WriteVolume(const PosedQuery& query, VolumeFormat format,
                                const std::filesystem::path& path) {
  if (format == VolumeFormat::kRaw || format == VolumeFormat::kDicom)
    throw std::logic_error("raw and DICOM volumes have functions of their own");
  const Posing posing = Begin(query);
  if (query.labels) return WriteLabels(path, posing.engine.PoseLabels(posing.pose, {}, query.level));
  kvx::WriteVolume(path, posing.engine.Pose(posing.pose, {}, query.level).volume,
                   posing.loaded->model.template_scan().stored_as);
}

void PipelinePoser::WriteDicom(const PosedQuery& query, const DicomNames& names,
                               const std::filesystem::path& path) {
  const Posing posing = Begin(query);
  const Model& model = posing.loaded->model;
  const PosedAs as{query.pose, query.mode, query.level, LargestExtrapolation(posing.pose)};
  const DicomSeries series = SeriesOf(model, as, names.modality, names.patient_id);
  const Volume posed = posing.engine.Pose(posing.pose, {}, query.level).volume;
  if (!query.labels) return WriteDicomZip(path, posed, DicomGreysOf(model.template_scan()), series);
  WritePosedBones(path, model, posing.engine.PoseLabels(posing.pose, {}, query.level), posed, series);
}

std::string PipelinePoser::RawVolume(const PosedQuery& query) {
  const Posing posing = Begin(query);
  if (query.labels) {
    const LabelMap labels = posing.engine.PoseLabels(posing.pose, {}, query.level);
    const std::vector<float> values(labels.values.begin(), labels.values.end());  // exact: 16 bits
    return RawHeader(labels.grid, ScalarType::kUint16) + Packed(ScalarType::kUint16, values);
  }
  PosedVolume posed = posing.loaded->TakeSpare();
  posing.engine.PoseInto(posed, posing.pose, {}, query.level);
  const ScalarType type = posing.loaded->model.template_scan().stored_as;
  std::string bytes = RawHeader(posed.volume.grid, type);
  AppendPacked(type, posed.volume.values, bytes);
  posing.loaded->KeepSpare(std::move(posed));
  return bytes;
}

std::string PipelinePoser::Field(const PosedQuery& query) {
  const PosingGate::Pass turn(field_gate_, query.asker);
  const Posing posing = Begin(query);
  const InverseGrid found = CoarseInverse(posing.engine, posing.loaded->model.body(), posing.pose,
                                          query.level, Progress({}, query.asker.abandoned));
  const std::vector<Eigen::Vector3f>& field = found.template_from_posed.values;
  return FieldHeader(found.template_from_posed.grid,
                     {found.largest_error_mm, found.p99_error_mm, found.mean_error_mm}) +
         std::string(reinterpret_cast<const char*>(field.data()), field.size() * sizeof field[0]);
}

void PipelinePoser::WriteRegistration(const std::string& id, const std::string& scan, RegistrationMap map,
                                      const std::filesystem::path& path, const Asker& asker) {
  std::optional<PosingGate::Pass> turn;
  if (map == RegistrationMap::kTemplateFromScan) turn.emplace(field_gate_, asker);
  const auto loaded = Require(id);
  const PosingGate::Pass pass(gate_, asker);
  switch (map) {
    case RegistrationMap::kScanFromTemplate:
      return WriteField(path, ScanFromTemplate(loaded->model, scan));
    case RegistrationMap::kTemplateFromScan:
      return WriteField(path, TemplateFromScan(loaded->model, scan, Progress({}, asker.abandoned)));
    case RegistrationMap::kConfidence:
      return kvx::WriteVolume(path, ConfidenceOf(loaded->model, scan), ScalarType::kUint8);
    case RegistrationMap::kError:
      return kvx::WriteVolume(path, PlaceErrorOf(loaded->model, scan), ScalarType::kFloat32);
  }
}

std::string PipelinePoser::WriteSlice(const PosedQuery& query, const SliceRequest& view, SliceFormat format,
                                      const std::filesystem::path& path) {
  const Posing posing = Begin(query);
  const Volume slice = PosedSlice(posing.engine, posing.pose, view);
  if (format == SliceFormat::kPng) {
    const Window window = ShownWindow(view, slice, posing.loaded->window);
    WritePng(path, PictureOf(slice, window));
    return SliceHeader(slice.grid, ScalarType::kUint8, std::pair<double, double>(window.low, window.high));
  }
  const ScalarType type = posing.loaded->model.template_scan().stored_as;
  kvx::WriteVolume(path, slice, type);
  return SliceHeader(slice.grid, type, {});
}

std::string PipelinePoser::Surface(const PosedQuery& query, const SurfaceParts& parts, SurfaceFormat format) {
  const auto loaded = Require(query.model);
  for (const std::string& bone : parts.bones) loaded->model.bones().IndexOf(bone);
  SurfaceChoice choice{parts.bones, parts.skin.value_or(false)};
  if (parts.skin && choice.Everything()) choice.bones = loaded->model.bone_names();
  const Posing posing = Begin(query);
  const auto surfaces = loaded->surfaces.Posed(posing.engine, posing.pose, choice);
  return format == SurfaceFormat::kGlb ? GlbBytes(surfaces) : StlBytes(surfaces);
}

AnimationFacts PipelinePoser::CheckAnimation(const AnimationTask& task) {
  constexpr int64_t kVersion = 3;  // raised when the same task becomes another file
  if (IsVideo(task) && !HasVideoProgram())
    throw InputError("video needs the program ffmpeg, which this service does not have; use format=nii.gz");
  const auto loaded = Require(task.model);
  const KeyFrames frames = ParseMotion(task.key_frames);
  RequireFewFrames(frames.FrameCount());
  const Motion motion(loaded->model.Resolver(), frames, task.mode);
  const Scan& of_template = loaded->model.template_scan();
  if (!IsVideo(task))  // before the work its grid stands for the room of all frames, which is seldom smaller
    RequireFewBytes(of_template.volume.grid, task.view.level, of_template.stored_as, frames.FrameCount());
  Hasher hasher;
  hasher.Add("animation")
      .Add(kVersion)
      .Add(ProgramVersion())
      .Add(int64_t(PosingEngine::kVersion))
      .Add(loaded->model.manifest().ContentDigest())
      .Add(task.key_frames);
  hasher.Add(int64_t(task.mode)).Add(int64_t(task.view.level)).Add(task.format);
  AddView(hasher, task.view.OfVideo());  // one without a plane is none across the usual axis
  return {frames.FrameCount(), hasher.Finish()};
}

void PipelinePoser::WriteAnimation(const AnimationTask& task, const std::string& name,
                                   const Progress& progress) {
  std::error_code ignored;
  std::filesystem::create_directories(data_.results(), ignored);
  const std::filesystem::path path = data_.results() / name;
  const auto loaded = Require(task.model);
  const KeyFrames frames = ParseMotion(task.key_frames);
  const Motion motion(loaded->model.Resolver(), frames, task.mode);
  const PosingEngine& engine = EngineOf(*loaded);
  const Grid grid = AnimationGrid(engine, motion, frames, progress.Part(0, 0.3));
  const Progress rest = progress.Part(0.3, 1);
  if (IsVideo(task)) {
    return AnimatePictures(engine, motion, frames, grid, task.view.OfVideo(), loaded->window,
                           *VideoFile(path, frames.fps), rest);
  }
  const ScalarType type = loaded->model.template_scan().stored_as;
  RequireFewBytes(grid, task.view.level, type, frames.FrameCount());
  const auto sink = NiftiSequence(path, type, frames.FrameCount(), frames.fps);
  AnimateVolumes(engine, motion, frames, grid, task.view.level, *sink, rest);
}

bool PipelinePoser::HasAnimation(const std::string& name) const {
  std::error_code none;
  return std::filesystem::exists(data_.results() / name, none);
}

std::vector<PointMm> PipelinePoser::MapPoints(const PosedQuery& query,
                                              const std::vector<PointMm>& in_template) {
  const Posing posing = Begin(query);
  return posing.engine.MapPoints(posing.pose, in_template);
}

}  // namespace kvx
