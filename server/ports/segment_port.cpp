// Segmentation for the service: short enough that a killed one starts again from the beginning.
#include <algorithm>
#include <fstream>
#include <iterator>

#include "core/errors.h"
#include "core/region_presets.h"
#include "pipeline/io/volume_file.h"
#include "pipeline/io/voxel_values.h"
#include "pipeline/model/warnings/study_warnings.h"
#include "pipeline/scans/load_scan.h"
#include "pipeline/segmentation/names/propose_names.h"
#include "pipeline/segmentation/segment_bones.h"
#include "pipeline/segmentation/strokes/carried_strokes.h"
#include "server/ports/pipeline_ports.h"
#include "server/ports/study_folder.h"

namespace kvx {
namespace {

std::vector<StudyFile> FilesOf(const SegmentTask& task) {
  std::vector<StudyFile> files{task.scan};
  if (task.strokes) files.push_back(*task.strokes);
  if (task.previous) files.push_back(*task.previous);
  return files;
}

}  // namespace

void PipelineBuilder::CheckSegment(const SegmentTask& task) {
  const StudyFolder folder(data_, FilesOf(task));
  const std::filesystem::path scan = folder.path() / task.scan.name;
  if (task.strokes) {
    const Grid grid = ReadVolumeInfo(scan).grid;
    CarriedStrokes(ReadLabels(folder.path() / task.strokes->name), grid, task.previous.has_value());
    if (task.previous) ReadPreviousLabels(folder.path() / task.previous->name, grid);
  } else {
    RequireThreshold(ReadScan(scan), task.level_hu);
  }
}

SegmentOutcome PipelineBuilder::Segment(const SegmentTask& task, const std::filesystem::path& out,
                                        const Progress& progress) {
  progress.Report("load", 0.0);
  RequireIntact(FilesOf(task));
  const StudyFolder folder(data_, FilesOf(task));
  const Artifact<Scan> scan{{}, std::make_shared<Scan>(ReadScanEvenly(folder.path() / task.scan.name))};
  const auto at = [&](const std::optional<StudyFile>& file) {
    return file ? folder.path() / file->name : std::filesystem::path();
  };
  auto backend = TakeBackend();
  StageContext stage{*backend, progress.Part(0.1, 0.9)};
  const SegmentedBones bones =
      SegmentBones::Run({scan, {}, at(task.strokes), {}, at(task.previous)}, {task.level_hu, {}}, stage);
  ReturnBackend(std::move(backend));
  progress.Report("names", 0.9);
  const Region region = RegionFromName(task.region);
  SegmentOutcome outcome{FactsOf(bones.labels, NamesOf(bones, region)), ScanWarnings("the scan", *scan)};
  std::ranges::move(WarningsOf(bones, outcome.facts.bones), std::back_inserter(outcome.warnings));
  if (region != Region::kCustom) {
    for (const std::string& doubt : NamesInDoubt(outcome.facts.bones)) outcome.warnings.push_back(doubt);
  }
  WriteLabels(out, bones.labels);
  return outcome;
}

void PipelineBuilder::ConvertLabels(const StudyFile& labels, const std::filesystem::path& out) {
  const StudyFolder folder(data_, {labels});
  WriteLabels(out, ReadLabels(folder.path() / labels.name));
}

void PipelineBuilder::ConvertScan(const StudyFile& scan, const std::filesystem::path& out) {
  const StudyFolder folder(data_, {scan});
  const Scan read = ReadScan(folder.path() / scan.name);
  if (out.extension() != ".raw") return WriteVolume(out, read.volume, read.stored_as);
  std::ofstream raw(out, std::ios::binary);
  raw << RawHeader(read.volume.grid, read.stored_as) << Packed(read.stored_as, read.volume.values);
  if (!raw.flush()) throw Unavailable("the scan cannot be converted; is the service's disk full?");
}

std::string PipelineBuilder::ConversionVersion() const {
  constexpr int kVersion = 1;  // raised when label maps are read, or files written, otherwise
  return std::to_string(kVersion) + "." + std::to_string(LoadScan::kVersion);
}

}  // namespace kvx
