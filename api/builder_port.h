// The port that runs long work on scans: models built, label maps made.
#pragma once
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "api/inspector_port.h"
#include "core/host/progress.h"

namespace kvx {

// A file of a study: the name study.json calls it by, and where its bytes lie.
struct StudyFile {
  std::string name;
  std::filesystem::path content;
};

// How the scans are registered. A limit of 0 is none; limits and seed are the published method's.
struct MethodChoice {
  std::string name = "adaptive";  // or "paper"
  int64_t max_blocks = 0;         // per scan
  double max_seconds = 0;         // per scan
  int64_t seed = 1;
};

struct BuildTask {
  std::string model;  // our id
  std::string study;  // study.json of the contract
  std::vector<StudyFile> files;
  MethodChoice method;
};

struct BuildOutcome {
  std::string digest;                 // of all artefacts of the model
  std::vector<std::string> warnings;  // "scan pose03, bone tibia: ..."
  double seconds = 0;                 // of all stages, those of earlier attempts too
};

// Strokes on a template, or a threshold of a CT.
struct SegmentTask {
  StudyFile scan;
  std::optional<StudyFile> strokes;   // none: by threshold
  std::optional<StudyFile> previous;  // the label map that fewer strokes gave
  std::optional<double> level_hu;     // of the threshold; none: found in the scan
  std::string region;
};

struct SegmentOutcome {
  LabelFacts facts;
  std::vector<std::string> warnings;
};

class ModelBuilder {
 public:
  virtual ~ModelBuilder() = default;
  virtual void Check(const BuildTask& task) = 0;  // throws InputError naming the field; quick
  // Finished stages of an earlier attempt are found, not redone. Throws Cancelled through `progress`.
  virtual BuildOutcome Build(const BuildTask& task, const Progress& progress) = 0;

  // Throws InputError for strokes or a scan that no label map can be made of; reads both.
  virtual void CheckSegment(const SegmentTask& task) = 0;
  // Writes the label map to `out`, a .nii.gz.
  virtual SegmentOutcome Segment(const SegmentTask& task, const std::filesystem::path& out,
                                 const Progress& progress) = 0;
  // A label map in the format that the end of `out` says.
  virtual void ConvertLabels(const StudyFile& labels, const std::filesystem::path& out) = 0;
  // A scan as it is read, likewise; a .raw begins with RawHeader (poser_port.h).
  virtual void ConvertScan(const StudyFile& scan, const std::filesystem::path& out) = 0;
  // Another one where the same file may become other bytes.
  virtual std::string ConversionVersion() const = 0;
};

}  // namespace kvx
