// Posed pictures: one slice in any plane, or a slab seen through, without the posed volume.
#pragma once
#include "pipeline/posing/posing_engine.h"

namespace kvx {

enum class SliceAxis { kAxial, kCoronal, kSagittal };
SliceAxis SliceAxisFromName(const std::string& name);  // throws InputError

enum class Projection { kNone, kMaximum, kMean };
Projection ProjectionFromName(const std::string& name);  // "none", "max", "mean"; throws InputError

// What a user asks for. Directions are LPS; what is left out follows from the posed body.
struct SliceRequest {
  SliceAxis axis = SliceAxis::kAxial;
  std::optional<double> at_mm;  // along the axis: z, y or x of the plane; else through the body's middle
  struct Oblique {
    PointMm centre;
    Eigen::Vector3d right, down;  // of the picture; made orthonormal
  };
  std::optional<Oblique> oblique;             // instead of an axis
  std::optional<double> width_mm, height_mm;  // else what shows the whole body
  std::optional<double> pixel_mm;             // else the template's smallest spacing, doubled per level
  int level = 0;                              // each halves the picture: a pixel is the mean of 2 x 2
  Projection projection = Projection::kNone;
  std::optional<double> slab_mm;  // of a projection; else the whole body
};

// One layer of square pixels: i to the right of the picture, j down, k into it. Radiological views: axial
// from the feet, coronal from the front, sagittal from the left.
Grid SliceGrid(const SliceRequest& request, const Grid& posed_body);

// A volume with one layer. Throws InputError for a plane that has no directions or too many pixels. A level
// takes as long as the same picture at the template's resolution: where that has too many voxels, pixels are
// means of fewer, and where `pixel_mm` is no larger than the template's voxels, of none.
// `posed_body`: the room that extents are taken from; else the posed body's own.
Volume PosedSlice(const PosingEngine& engine, const ResolvedPose& pose, const SliceRequest& request,
                  const std::optional<Grid>& posed_body = {});

}  // namespace kvx
