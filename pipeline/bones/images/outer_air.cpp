// Half way from air to tissue.
#include "pipeline/bones/images/outer_air.h"

#include "core/voxels/components.h"
#include "pipeline/bones/images/levels.h"
#include "pipeline/scans/air_level.h"

namespace kvx {

Volume OuterAir(const Volume& volume, const std::string& modality, double voxel_mm) {
  const Volume coarse = CoarsenedTo(volume, voxel_mm);
  Volume out(coarse.grid);
  const std::optional<AirLevel> level = FindAirLevel(coarse, modality);
  if (!level) return out;
  const double threshold = 0.5 * (level->air + level->tissue);
  Mask dark(coarse.grid);
  for (size_t v = 0; v < dark.values.size(); ++v) dark.values[v] = coarse.values[v] < threshold;
  const Mask air = PiecesAtBorder(dark);
  for (size_t v = 0; v < air.values.size(); ++v) out.values[v] = air.values[v] ? 1.0f : 0.0f;
  return out;
}

}  // namespace kvx
