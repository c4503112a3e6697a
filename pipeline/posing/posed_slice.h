// Posed pictures: one slice in any plane, or a slab seen through, without the posed volume.
#pragma once
#include "core/slice_request.h"
#include "pipeline/posing/posing_engine.h"

namespace kvx {

// One layer of square pixels: i to the right of the picture, j down, k into it. Radiological views: axial
// from the feet, coronal from the front, sagittal from the left.
Grid SliceGrid(const SliceRequest& request, const Grid& posed_body);

// Where the room of a posed body lies along the direction across a plane: mm along the axis, LPS; of an
// oblique plane along right x down.
struct RoomAcross {
  double from_mm, to_mm;
};
// Nothing where the picture looks through that room. Beside it there is air alone.
std::optional<RoomAcross> RoomBesidePlane(const SliceRequest& request, const Grid& posed_body);

// A volume with one layer. Throws InputError for a plane that has no directions or too many pixels. A level
// takes as long as the same picture at the template's resolution: where that has too many voxels, pixels are
// means of fewer, and where `pixel_mm` is no larger than the template's voxels, of none.
// `posed_body`: the room that extents are taken from; else the posed body's own.
Volume PosedSlice(const PosingEngine& engine, const ResolvedPose& pose, const SliceRequest& request,
                  const std::optional<Grid>& posed_body = {});

}  // namespace kvx
