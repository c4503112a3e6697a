// Anatomy, mechanics, scans and truth to files. Poses are independent, so each runs on one thread from
// mechanics to file.
#include "pipeline/phantom/write_phantom.h"

#include <algorithm>
#include <fstream>
#include <iomanip>
#include <mutex>
#include <nlohmann/json.hpp>
#include <sstream>

#include "core/errors.h"
#include "core/host/parallel.h"
#include "pipeline/io/volume_file.h"
#include "pipeline/phantom/manifest.h"

namespace kvx::phantom {
namespace {

namespace fs = std::filesystem;
using Eigen::Vector3d;

constexpr double kManyOverlapping = 0.002;  // of soft truth points, above which a user is told

// Where files grow until all is done; removed when it is not. A folder that is there is filled and not put in
// the place of: it may be a mount's, or where a shell stands.
class PartialFolder {
 public:
  explicit PartialFolder(const fs::path& final_folder)
      : final_(fs::absolute(final_folder).lexically_normal()) {
    if (!final_.has_filename()) final_ = final_.parent_path();
    std::error_code error;
    inside_ = fs::is_directory(final_, error);
    if (inside_ ? !HoldsNothing(final_) : fs::exists(final_, error))
      throw InputError("the output folder exists and is not empty; choose another one or remove it");
    part_ =
        inside_ ? final_ / kPartial : final_.parent_path() / ("." + final_.filename().string() + kPartial);
    fs::remove_all(part_, error);
    if (!fs::create_directories(part_ / "truth", error)) {
      if (IsDenial(error))
        throw Denied("the output folder may not be created; choose a place where you may write");
      throw Unavailable("the output folder cannot be created; is the place writable and the disk not full?");
    }
  }
  ~PartialFolder() {
    std::error_code error;
    fs::remove_all(part_, error);
  }
  PartialFolder(const PartialFolder&) = delete;
  PartialFolder& operator=(const PartialFolder&) = delete;

  const fs::path& path() const { return part_; }
  void Finish() try {
    if (!inside_) return fs::rename(part_, final_);
    std::vector<fs::path> parts;
    for (const auto& entry : fs::directory_iterator(part_)) parts.push_back(entry.path());
    for (const fs::path& part : parts) fs::rename(part, final_ / part.filename());
  } catch (const fs::filesystem_error&) {
    throw Unavailable(
        "the finished phantom cannot be moved to the output folder; is it still there and empty?");
  }

 private:
  static constexpr char kPartial[] = ".partial";

  // But for what a killed program left.
  static bool HoldsNothing(const fs::path& folder) {
    std::error_code error;
    return std::all_of(fs::directory_iterator(folder, error), {},
                       [](const fs::path& entry) { return entry.filename() == kPartial; });
  }

  fs::path final_, part_;
  bool inside_ = false;
};

// One progress of several threads: the mean of their shares, reported one at a time.
class SharedProgress {
 public:
  SharedProgress(const Progress& whole, size_t parts) : whole_(whole), shares_(parts, 0) {}
  Progress Of(size_t part) {
    return Progress([this, part](std::string_view stage, double share) { Report(part, stage, share); }, {});
  }

 private:
  void Report(size_t part, std::string_view stage, double share) {
    const std::lock_guard lock(guard_);
    shares_[part] = std::max(shares_[part], share);
    double sum = 0;
    for (const double s : shares_) sum += s;
    whole_.Report(stage, sum / double(shares_.size()));
  }
  const Progress& whole_;
  std::mutex guard_;
  std::vector<double> shares_;
};

void WriteJson(const fs::path& path, const nlohmann::ordered_json& json) {
  std::ofstream file(path, std::ios::binary);
  file << json.dump(1) << '\n';
  if (!file.flush()) throw Unavailable("a file of the phantom cannot be written; is the disk full?");
}

std::vector<PhantomPose> ChosenPoses(const Anatomy& anatomy, const PhantomSettings& settings) {
  std::vector<PhantomPose> chosen;
  for (PhantomPose& pose : MakePoses(anatomy, settings.seed)) {
    const bool wanted =
        settings.poses.empty() || pose.index == 0 ||
        std::find(settings.poses.begin(), settings.poses.end(), pose.name) != settings.poses.end();
    if (!wanted) continue;
    pose.index = int(chosen.size());
    chosen.push_back(std::move(pose));
  }
  return chosen;
}

// Everything that poses share.
struct World {
  Anatomy anatomy;
  PhantomSettings settings;
  BoneFields fields;
  BodyModel body;
  TissueModel tissues;
  MaterialMap material;
  DistanceGrid skin;
  Scanner scanner;

  World(Anatomy a, const PhantomSettings& s)
      : anatomy(std::move(a)),
        settings(s),
        fields(anatomy),
        body(anatomy, fields, SolidOptions{}),
        tissues(anatomy, s.seed),
        material(anatomy, tissues, 0.5 * s.grid.spacing_mm.minCoeff()),
        skin(SampleDistance(anatomy.body.Bounds().Grown(2 * anatomy.cell_mm), anatomy.distance_step_mm,
                            [this](const Vector3d& x) { return anatomy.body.Distance(x); })),
        scanner{s.grid, material.MeanInBody() / s.snr, s.seed} {}
};

struct TemplateLabels {
  LabelMap bones, tissues;
};

TemplateLabels LabelTemplate(const World& world) {
  const ScanGrid& grid = world.scanner.grid;
  TemplateLabels labels{LabelMap(grid.World()), LabelMap(grid.World())};
  ParallelFor(
      grid.size.z(),
      [&](int k) {
        for (int j = 0; j < grid.size.y(); ++j) {
          for (int i = 0; i < grid.size.x(); ++i) {
            const Vector3d x = grid.At(Vector3d(i, j, k));
            if (world.anatomy.body.Distance(x) > 0) continue;
            labels.bones(i, j, k) = uint16_t(world.tissues.BoneAt(x) + 1);
            labels.tissues(i, j, k) = uint16_t(world.tissues.At(x, world.material.step_mm()).tissue);
          }
        }
      },
      world.settings.threads);
  return labels;
}

double MeanFromBlend(const World& world, const std::vector<TruthPoint>& points,
                     const TruthPositions& positions, const PoseRecord& record) {
  double sum = 0, count = 0;
  for (size_t i = 0; i < points.size(); ++i) {
    if (points[i].bone != 0) continue;
    const Vector3d blended = world.body.Guess(points[i].rest, record.posed.posed_from_template);
    sum += (positions.in_scan[i] - Move(record.pose.scan_from_posed, blended)).norm();
    ++count;
  }
  return count > 0 ? sum / count : 0;
}

class PoseWriter {
 public:
  PoseWriter(const World& world, const fs::path& folder) : world_(world), folder_(folder) {
    const BodyModel::Posed rest = world.body.Pose(PhantomPose{}, {});
    const CompositeMotion motion(world.anatomy, world.fields, world.skin, world.body.mesh(), rest);
    points_ = DrawTruthPoints(world.anatomy, world.tissues, world.scanner.grid, motion, world.settings.points,
                              world.settings.seed);
  }

  PoseRecord Write(const PhantomPose& pose, const Progress& progress) {
    PoseRecord record{pose, world_.body.Pose(pose, progress.Part(0, 0.5))};
    const CompositeMotion motion(world_.anatomy, world_.fields, world_.skin, world_.body.mesh(),
                                 record.posed);
    const TruthPositions positions =
        MoveTruthPoints(points_, motion, pose.scan_from_posed, world_.scanner.grid);
    const ScanImages images =
        Acquire(world_.scanner, pose.index, pose.scan_from_posed, motion, world_.material,
                world_.tissues.FluidIntensity(), progress.Part(0.5, 0.95));
    record.in_fov = positions.in_fov_share;
    record.hidden = positions.hidden_share;
    record.faults = FaultsOf(points_, motion);
    record.soft_vs_blend_mm = MeanFromBlend(world_, points_, positions, record);
    WriteFiles(pose, images, positions);
    record.posed.nodes.clear();
    progress.Report("phantom: writing", 1.0);
    return record;
  }

 private:
  void WriteFiles(const PhantomPose& pose, const ScanImages& images, const TruthPositions& positions) {
    const std::lock_guard lock(files_);
    const std::string stem = PoseFileStem(pose.index);
    WriteVolume(folder_ / (stem + ".nii.gz"), images.intensities, ScalarType::kUint8);
    WriteNpz(folder_ / "truth" / (stem + "_points.npz"), TruthArrays(points_, positions));
    if (pose.index == 0) return;
    LabelMap valid(images.valid.grid);
    std::copy(images.valid.values.begin(), images.valid.values.end(), valid.values.begin());
    WriteLabels(folder_ / "truth" / (stem + "_valid.nii.gz"), valid);
  }

  const World& world_;
  fs::path folder_;
  std::vector<TruthPoint> points_;
  std::mutex files_;
};

std::vector<std::string> Warnings(const std::vector<PoseRecord>& records) {
  std::vector<std::string> warnings;
  for (const PoseRecord& record : records) {
    if (record.faults.overlapping_share < kManyOverlapping) continue;
    std::ostringstream text;
    text << std::fixed << std::setprecision(1) << PoseFileStem(record.pose.index) << " (" << record.pose.name
         << "): " << 100 * record.faults.overlapping_share
         << " % of the soft tissue shares its place with other tissue; score no points that are hidden";
    warnings.push_back(text.str());
  }
  return warnings;
}

}  // namespace

PhantomSettings SettingsFor(const PhantomOptions& options) {
  if (options.region == Region::kCustom) throw InputError("a phantom is a hand or a knee; name one of them");
  PhantomSettings settings;
  settings.region = options.region;
  settings.seed = options.seed;
  const bool hand = options.region == Region::kHand;
  // The paper's scans
  settings.grid.size = hand ? Eigen::Vector3i(256, 256, 100) : Eigen::Vector3i(256, 256, 136);
  settings.grid.spacing_mm = hand ? Vector3d(0.78125, 0.78125, 1.0) : Vector3d(1.25, 1.25, 1.2);
  if (options.half_scale) settings.grid.size /= 2, settings.grid.spacing_mm *= 2;
  return settings;
}

std::vector<std::string> WritePhantom(const PhantomSettings& settings, const fs::path& folder,
                                      const Progress& progress) {
  PartialFolder partial(folder);
  progress.Report("phantom: anatomy", 0);
  Anatomy anatomy = settings.region == Region::kHand ? MakeHand(settings.seed) : MakeKnee(settings.seed);
  if (settings.cell_mm > 0) anatomy.cell_mm = settings.cell_mm;
  const World world(std::move(anatomy), settings);
  const TemplateLabels labels = LabelTemplate(world);
  WriteLabels(partial.path() / "bones_template.nii.gz", labels.bones);
  WriteLabels(partial.path() / "tissue_template.nii.gz", labels.tissues);
  PoseWriter writer(world, partial.path());
  const std::vector<PhantomPose> poses = ChosenPoses(world.anatomy, settings);
  const Progress scanning = progress.Part(0.15, 0.98);
  SharedProgress shared(scanning, poses.size());
  std::vector<PoseRecord> records(poses.size());
  ParallelFor(
      int(poses.size()),
      [&](int i) { records[size_t(i)] = writer.Write(poses[size_t(i)], shared.Of(size_t(i))); },
      settings.threads);
  const ManifestInputs inputs{world.anatomy, world.scanner, world.tissues,
                              labels.bones,  settings.seed, world.material.step_mm(),
                              settings.snr,  records};
  WriteJson(partial.path() / "manifest.json", Manifest(inputs));
  const std::string name =
      std::string(settings.region == Region::kHand ? "hand" : "knee") + "-" + std::to_string(settings.seed);
  WriteJson(partial.path() / "study.json", StudyFile(world.anatomy, name, records));
  partial.Finish();
  progress.Report("phantom: done", 1);
  return Warnings(records);
}

}  // namespace kvx::phantom

namespace kvx {

std::vector<std::string> WritePhantom(const PhantomOptions& options, const std::filesystem::path& folder,
                                      const Progress& progress) {
  return phantom::WritePhantom(phantom::SettingsFor(options), folder, progress);
}

}  // namespace kvx
