// The port that shows a model in a pose: volumes, slices, surfaces, fields, animations, points.
#pragma once
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "core/deformation_mode.h"
#include "core/digest.h"
#include "core/host/asker.h"
#include "core/host/progress.h"
#include "core/pose.h"
#include "core/scan.h"
#include "core/slice_request.h"

namespace kvx {

enum class VolumeFormat { kNiftiGz, kNifti, kNrrd, kMha, kRaw, kDicom };

// What a DICOM series says beside its voxels.
struct DicomNames {
  std::string patient_id;  // our id of the subject
  std::string modality;    // MR or CT; empty: as the template scan's file said
};

struct PosedQuery {
  std::string model;  // our id
  PoseRequest pose;
  DeformationMode mode = DeformationMode::kEvd;
  int level = 0;        // halves the resolution, 0..5
  bool labels = false;  // a volume of bone labels instead of intensities
  Asker asker;
};

enum class SliceFormat { kPng, kNiftiGz, kNrrd, kRaw };

struct SurfaceParts {
  std::vector<std::string> bones;  // each once
  std::optional<bool> skin;        // left out and no bones: everything; false and no bones: all bones
};
enum class SurfaceFormat { kGlb, kStl };

struct AnimationTask {
  std::string model;
  std::string key_frames;  // JSON as for `kinevox animate`
  DeformationMode mode = DeformationMode::kEvd;
  std::string format = "nii.gz";  // nii, nii.gz: 4-D volumes of its level; mp4, webm: a video of `view`
  SliceRequest view;
};
struct AnimationFacts {
  int frames = 0;
  Digest digest;  // of all that the file depends on
};

struct PoseFacts {
  // Of the model's content, the pose as resolved, mode, level and the program's version:
  // equal digests, equal voxels.
  Digest digest;
  // How far outside the examples the worst placed bone is asked to go, in typical distances between examples;
  // 0: inside. By bones alone (VBD), too, though nothing is learnt from examples then.
  double extrapolation = 0;
  // Of the scan that it is posed as in, as in the model's document; empty of other poses.
  std::string scan_verdict;
  // Equal digests: coordinates of the same world, which a DICOM series says; poses alike may be in two.
  Digest world{};
};

// What the registration of one training scan found: displacements in mm (LPS) on the template's or the scan's
// grid, or how sure it is on the template's grid: per cent, or mm that it may be off.
enum class RegistrationMap { kScanFromTemplate, kTemplateFromScan, kConfidence, kError };

class ModelPoser {
 public:
  virtual ~ModelPoser() = default;
  virtual PoseRequest ParsePose(
      std::string_view json) = 0;  // a pose file; throws InputError naming the field
  virtual std::string InfoJson(const std::string& model) = 0;  // as `kinevox info --json`
  virtual PoseFacts FactsOf(const PosedQuery& query) = 0;
  // Raw files start with RawHeader (below), then voxels,
  // little-endian, of the template's scalar type, i fastest.
  virtual void WriteVolume(const PosedQuery& query, VolumeFormat format,
                           const std::filesystem::path& path) = 0;
  virtual std::string RawVolume(const PosedQuery& query) = 0;  // the raw form, in memory
  virtual void WriteDicom(const PosedQuery& query, const DicomNames& names,
                          const std::filesystem::path& path) = 0;  // a zip of one series; labels: one file
  // RawHeader of its grid with `errors`, then the displacement
  // to the template per node: three floats, LPS mm.
  virtual std::string Field(const PosedQuery& query) = 0;
  // nii.gz, nrrd or mha. Throws NotFound for the template and for what the model does not have.
  virtual void WriteRegistration(const std::string& model, const std::string& scan, RegistrationMap map,
                                 const std::filesystem::path& path, const Asker& asker) = 0;
  // Returns SliceHeader of what it shows.
  virtual std::string WriteSlice(const PosedQuery& query, const SliceRequest& view, SliceFormat format,
                                 const std::filesystem::path& path) = 0;
  virtual std::string Surface(const PosedQuery& query, const SurfaceParts& parts, SurfaceFormat format) = 0;
  // Throws InputError, NotFound for what cannot be animated, before any work.
  virtual AnimationFacts CheckAnimation(const AnimationTask& task) = 0;
  // Puts the file among the data folder's results under `name`, whole or not at all:
  // whoever made it, the service finds it there.
  virtual void WriteAnimation(const AnimationTask& task, const std::string& name,
                              const Progress& progress) = 0;
  virtual bool HasAnimation(const std::string& name) const = 0;  // among those results
  virtual void Forget(const std::string&) {}                     // the model was deleted: its own files go
  virtual void Sweep() {}  // what forgotten models alone had made goes, now or when running builds allow
  virtual std::vector<PointMm> MapPoints(const PosedQuery& query,
                                         const std::vector<PointMm>& in_template) = 0;
  virtual bool DeviceHasRoom() const { return true; }  // to keep what its device compiles
};

// The geometry of a raw volume as JSON, padded with spaces to kRawHeaderBytes,
// so that a cached file is complete in itself.
constexpr size_t kRawHeaderBytes = 1024;
std::string RawHeader(const Grid& grid, ScalarType type);

// The same of a slice; of a picture with the intensities that it shows black and white.
std::string SliceHeader(const Grid& layer, ScalarType type,
                        const std::optional<std::pair<double, double>>& window);

// Of a coarse field over tissue, against the exact map.
struct FieldErrors {
  double largest_mm = 0, p99_mm = 0, mean_mm = 0;
};
std::string FieldHeader(const Grid& grid, const FieldErrors& errors);

}  // namespace kvx
