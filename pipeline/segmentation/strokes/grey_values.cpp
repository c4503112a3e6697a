// Neighbours along the axes are counted; a single voxel with nothing beside it says nothing.
#include "pipeline/segmentation/strokes/grey_values.h"

#include <algorithm>
#include <vector>

#include "core/errors.h"
#include "core/voxels/voxel_box.h"
#include "pipeline/segmentation/strokes/carried_strokes.h"

namespace kvx {
namespace {

struct Beside {
  size_t itself = 0, others = 0;
};

void Count(uint16_t one, uint16_t next, std::vector<Beside>& beside) {
  if (!IsOfBone(one) || !IsOfBone(next)) return;
  if (one == next) {
    beside[one].itself += 2;
  } else {
    ++beside[one].others, ++beside[next].others;
  }
}

}  // namespace

bool HoldsGreys(const LabelMap& labels) {
  std::vector<Beside> beside(65536);
  const Eigen::Vector3i size = labels.grid.size;
  ForEachVoxel({Eigen::Vector3i::Zero(), size}, [&](const Eigen::Vector3i& p) {
    for (int a = 0; a < 3; ++a) {
      const Eigen::Vector3i next = p + Eigen::Vector3i::Unit(a);
      if (next[a] < size[a]) Count(labels(p.x(), p.y(), p.z()), labels(next.x(), next.y(), next.z()), beside);
    }
  });
  const auto scattered = std::ranges::count_if(beside, [](const Beside& b) { return b.others > b.itself; });
  const auto together =
      std::ranges::count_if(beside, [](const Beside& b) { return b.itself > 0 && b.others <= b.itself; });
  return scattered > together;
}

void RequireNoGreys(const LabelMap& strokes) {
  if (!HoldsGreys(strokes)) return;
  throw InputError(
      "the strokes hold greys as a scan does, not marks: give a label map that is 0 but where a stroke is "
      "drawn, with one number a bone (1, 2, ...) and 255 for the background");
}

void RequireNoScan(const LabelMap& labels, const std::string& name) {
  if (!HoldsGreys(labels)) return;
  throw InputError("the " + name +
                   " holds greys as a scan does, not labels: give one that is 0 but in bones, with one "
                   "number a bone (1, 2, ...)");
}

}  // namespace kvx
