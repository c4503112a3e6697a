// What the handlers need of the pipeline. server/ fills these with the real thing; the handlers know nothing else.
#pragma once
#include <filesystem>
#include <string>
#include <vector>

#include "core/digest.h"
#include "core/pose.h"
#include "core/progress.h"
#include "core/scan.h"

namespace kvx {

struct ScanFacts {
  Grid grid;
  ScalarType stored_as = ScalarType::kFloat32;
  std::string modality;
};

struct LabelFacts {
  Grid grid;
  std::vector<int> labels;  // values that occur, without 0
};

// Reads an upload before it is accepted. Throws InputError saying what to do.
class ScanInspector {
 public:
  virtual ~ScanInspector() = default;
  virtual ScanFacts InspectScan(const std::filesystem::path& file_or_folder) = 0;
  virtual LabelFacts InspectLabels(const std::filesystem::path& file) = 0;
};

// A file of a study: the name study.json calls it by, and where its bytes lie.
struct StudyFile {
  std::string name;
  std::filesystem::path content;
};

struct BuildTask {
  std::string model;               // our id
  std::string study;               // study.json of the contract
  std::vector<StudyFile> files;
  std::string method;              // "adaptive" or "paper"
};

struct BuildOutcome {
  std::string digest;              // of all artefacts of the model
  std::vector<std::string> warnings;  // "scan pose03, bone tibia: ..."
  double seconds = 0;                 // of all stages, those of earlier attempts too
};

class ModelBuilder {
 public:
  virtual ~ModelBuilder() = default;
  virtual void Check(const BuildTask& task) = 0;  // throws InputError naming the field; quick
  // Finished stages of an earlier attempt are found, not redone. Throws Cancelled through `progress`.
  virtual BuildOutcome Build(const BuildTask& task, const Progress& progress) = 0;
};

enum class PosingMode { kEvd, kVbd };
enum class VolumeFormat { kNiftiGz, kNrrd, kMha, kRaw };

struct PosedQuery {
  std::string model;               // our id
  PoseRequest pose;
  PosingMode mode = PosingMode::kEvd;
  int level = 0;                   // halves the resolution, 0..4
};

class ModelPoser {
 public:
  virtual ~ModelPoser() = default;
  virtual PoseRequest ParsePose(std::string_view json) = 0;     // a pose file; throws InputError naming the field
  virtual std::string InfoJson(const std::string& model) = 0;   // as `kinevox info --json`
  // Of the model's content, the pose as resolved, mode, level and the program's version: equal digests, equal voxels.
  virtual Digest PoseDigest(const PosedQuery& query) = 0;
  // Raw files start with RawHeader (below), then voxels, little-endian, of the template's scalar type, i fastest.
  virtual void WriteVolume(const PosedQuery& query, VolumeFormat format, const std::filesystem::path& path) = 0;
  virtual void Forget(const std::string&) {}  // the model was deleted: its files go, now or when running builds allow
  virtual std::vector<PointMm> MapPoints(const PosedQuery& query, const std::vector<PointMm>& in_template) = 0;
};

// The geometry of a raw volume as JSON, padded with spaces to kRawHeaderBytes, so that a cached file is complete in itself.
constexpr size_t kRawHeaderBytes = 1024;
std::string RawHeader(const Grid& grid, ScalarType type);

}  // namespace kvx
