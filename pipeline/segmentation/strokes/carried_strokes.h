// Strokes of a label map on the grid of the scan that they were drawn in.
#pragma once
#include "core/image.h"

namespace kvx {

constexpr uint16_t kBackgroundStroke = 255;
inline bool IsOfBone(uint16_t stroke) { return stroke != 0 && stroke != kBackgroundStroke; }

// Each marked voxel is carried to the scan's voxel at its place. Throws InputError with what to do: no bone
// is marked (nor the background, where that suffices: beside previous labels), what is given is a scan,
// strokes lie outside the scan, or the map has the scan's size but lies elsewhere in the world.
LabelMap CarriedStrokes(const LabelMap& strokes, const Grid& scan, bool background_suffices = false);

}  // namespace kvx
