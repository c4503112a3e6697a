// Uploads are read whole before they are accepted:
// a truncated file is refused now, not in the middle of a build.
#include <algorithm>
#include <set>

#include "core/errors.h"
#include "core/region_presets.h"
#include "pipeline/io/volume_file.h"
#include "pipeline/segmentation/mend_labels.h"
#include "pipeline/segmentation/names/propose_names.h"
#include "pipeline/segmentation/strokes/grey_values.h"
#include "server/ports/pipeline_ports.h"

namespace kvx {
namespace {

constexpr size_t kMostVoxels = size_t(1) << 29;  // 2 GiB as float
constexpr size_t kMostLabels = 256;              // of a body's 206 bones; a scan has more different values

void RequireFewVoxels(const Grid& grid, const std::string& what) {
  const size_t voxels = grid.VoxelCount();
  if (voxels <= kMostVoxels) return;
  throw InputError("the " + what + " has " + std::to_string(voxels) + " voxels and the service takes " +
                   std::to_string(kMostVoxels) +
                   " at most; send scans cut to the region or of coarser resolution");
}

void RequireFewLabels(const LabelMap& labels) {
  const std::set<uint16_t> values(labels.values.begin(), labels.values.end());
  if (values.size() <= kMostLabels + 1 && !HoldsGreys(labels)) return;
  throw InputError("the file holds " + std::to_string(values.size()) +
                   " different values: that is a scan, not a label map; bones have the values 1, 2, ...");
}

}  // namespace

LabelFacts FactsOf(const LabelMap& labels, std::vector<ProposedBone> bones) {
  LabelFacts facts{labels.grid, {}, std::move(bones)};
  for (const ProposedBone& bone : facts.bones) facts.labels.push_back(bone.label);
  return facts;
}

ScanFacts PipelineInspector::InspectScan(const std::filesystem::path& path, const std::string&) {
  RequireFewVoxels(ReadVolumeInfo(path).grid, "scan");
  const Scan scan = ReadScan(path);
  const std::vector<float>& values = scan.volume.values;
  if (std::count(values.begin(), values.end(), values.front()) == std::ptrdiff_t(values.size()))
    throw InputError("the scan has the same value everywhere and shows nothing; export it again");
  return {scan.volume.grid, scan.stored_as, scan.modality};
}

LabelFacts PipelineInspector::InspectLabels(const std::filesystem::path& path, const std::string& region,
                                            const std::string&) {
  RequireFewVoxels(ReadLabelsGrid(path), "label map");
  const LabelMap labels = ReadLabels(path);
  RequireFewLabels(labels);
  LabelFacts facts = FactsOf(labels, NamesByNumber(MendLabels(labels).labels, RegionFromName(region)));
  if (facts.labels.empty()) throw InputError("the label map is empty: bones have the values 1, 2, ...");
  return facts;
}

}  // namespace kvx
