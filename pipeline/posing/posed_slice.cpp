// A slice is a posed volume of one layer;
// a projection poses its layers and keeps one value of each line of sight. Coarser pictures are means of what
// is posed at the template's resolution.
#include "pipeline/posing/posed_slice.h"

#include <algorithm>
#include <limits>

#include "core/errors.h"

namespace kvx {
namespace {

constexpr double kMostPixels = 4096.0 * 4096.0;
constexpr double kMostVoxels = 256.0 * 1024 * 1024;  // of a slab

struct Frame {
  Eigen::Vector3d right, down, into;
};

Frame FrameOf(const SliceRequest& request) {
  const Eigen::Vector3d left = Eigen::Vector3d::UnitX(), posterior = Eigen::Vector3d::UnitY(),
                        superior = Eigen::Vector3d::UnitZ();
  if (!request.oblique) {
    switch (request.Axis()) {
      case SliceAxis::kAxial:
        return {left, posterior, superior};
      case SliceAxis::kCoronal:
        return {left, -superior, posterior};
      case SliceAxis::kSagittal:
        return {posterior, -superior, -left};
    }
  }
  const double right_length = request.oblique->right.norm();
  if (!(right_length > 1e-6)) throw InputError("'right' of the plane has no length");
  const Eigen::Vector3d right = request.oblique->right / right_length;
  const Eigen::Vector3d down = request.oblique->down - request.oblique->down.dot(right) * right;
  if (!(down.norm() > 1e-3 * request.oblique->down.norm()))
    throw InputError("'right' and 'down' of the plane are parallel");
  return {right, down.normalized(), right.cross(down.normalized())};
}

struct Extent {
  double least = std::numeric_limits<double>::infinity(), most = -least;
  double Middle() const { return (least + most) / 2; }
  double Length() const { return most - least; }
};

// Of the grid's box, voxels' outer faces included, along a direction.
Extent Along(const Grid& grid, const Eigen::Vector3d& direction) {
  Extent out;
  for (int corner = 0; corner < 8; ++corner) {
    Eigen::Vector3d at;
    for (int a = 0; a < 3; ++a) at[a] = (corner >> a) & 1 ? grid.size[a] - 0.5 : -0.5;
    const double place = grid.ToMm(PointVox{at}).lps.dot(direction);
    out.least = std::min(out.least, place), out.most = std::max(out.most, place);
  }
  return out;
}

double RequirePositive(double value, const char* what) {
  if (!(value > 0) || !std::isfinite(value)) throw InputError(std::string("'") + what + "' must be above 0");
  return value;
}

int Steps(double length_mm, double step_mm) {
  return int(std::clamp(std::ceil(length_mm / step_mm - 1e-6), 1.0, 1e6));
}

// Where the plane lies along its own direction.
double Depth(const SliceRequest& request, const Frame& frame, const Extent& body) {
  if (request.oblique) return request.oblique->centre.lps.dot(frame.into);
  if (!request.at_mm) return body.Middle();
  return request.Axis() == SliceAxis::kSagittal ? -*request.at_mm : *request.at_mm;
}

Volume Projected(const Volume& slab, Projection projection) {
  Grid flat = slab.grid;
  const int layers = flat.size.z();
  flat.size.z() = 1;
  flat.spacing_mm.z() = flat.spacing_mm.x();  // as a slice's
  flat.origin = slab.grid.ToMm(PointVox{Eigen::Vector3d(0, 0, (layers - 1) / 2.0)});
  Volume out(flat);
  for (size_t pixel = 0; pixel < out.values.size(); ++pixel) {
    float most = -std::numeric_limits<float>::infinity();
    double sum = 0;
    for (int k = 0; k < layers; ++k) {
      const float value = slab.values[size_t(k) * out.values.size() + pixel];
      most = std::max(most, value), sum += value;
    }
    out.values[pixel] = projection == Projection::kMaximum ? most : float(sum / layers);
  }
  return out;
}

double PixelMm(const SliceRequest& request, const Grid& posed_body) {
  return request.pixel_mm ? RequirePositive(*request.pixel_mm, "pixel_mm")
                          : posed_body.spacing_mm.minCoeff() * double(1 << request.level);
}

// Layers of pixels, each of parts x parts smaller ones. The layers fill the slab, as many as such pixels are
// wide or, where those are finer, the template's voxels: between these is nothing more to see.
Grid DividedGrid(const SliceRequest& request, const Grid& posed_body, int parts) {
  const Frame frame = FrameOf(request);
  const double pixel = PixelMm(request, posed_body), step = pixel / parts;
  const Extent across = Along(posed_body, frame.right), down = Along(posed_body, frame.down),
               depth = Along(posed_body, frame.into);
  const double width = request.width_mm ? RequirePositive(*request.width_mm, "width_mm") : across.Length(),
               height = request.height_mm ? RequirePositive(*request.height_mm, "height_mm") : down.Length();
  const bool whole_slab = request.projection != Projection::kNone && !request.slab_mm;
  const double slab = request.projection == Projection::kNone ? step
                      : request.slab_mm                       ? RequirePositive(*request.slab_mm, "slab_mm")
                                                              : depth.Length();
  const int layers = Steps(slab, std::max(step, posed_body.spacing_mm.minCoeff()));
  Grid grid;
  grid.spacing_mm = {step, step, slab / layers};
  grid.size = {parts * Steps(width, pixel), parts * Steps(height, pixel), layers};
  grid.direction << frame.right, frame.down, frame.into;
  const bool centred = request.oblique && request.width_mm, tall = request.oblique && request.height_mm;
  const double middle_across = centred ? request.oblique->centre.lps.dot(frame.right) : across.Middle(),
               middle_down = tall ? request.oblique->centre.lps.dot(frame.down) : down.Middle(),
               middle_depth = whole_slab ? depth.Middle() : Depth(request, frame, depth);
  const Eigen::Vector3d half = (grid.size.cast<double>().array() - 1) / 2 * grid.spacing_mm.array();
  grid.origin.lps = frame.right * (middle_across - half.x()) + frame.down * (middle_down - half.y()) +
                    frame.into * (middle_depth - half.z());
  return grid;
}

bool PixelsAreFewEnough(const Grid& grid) { return double(grid.size.x()) * grid.size.y() <= kMostPixels; }
bool VoxelsAreFewEnough(const Grid& grid, double most_voxels) {
  return grid.size.cast<double>().prod() <= std::min(kMostVoxels, most_voxels);
}

void RequireFewEnough(const Grid& grid, double most_voxels) {
  if (!PixelsAreFewEnough(grid))
    throw InputError("the picture would have too many pixels; make 'pixel_mm' larger or the picture smaller");
  if (!VoxelsAreFewEnough(grid, most_voxels))
    throw InputError(
        "the picture would be looked through too many voxels; make 'pixel_mm' larger, or 'slab_mm' or the "
        "picture smaller");
}

// Of each side: twice as many per level, but none smaller than the template's voxels, and no more than may
// be posed at once.
int PartsOfAPixel(const SliceRequest& request, const Grid& posed_body, double most_voxels) {
  constexpr double kRounding = 1e-3;  // of a pixel that was told in digits
  const double most = PixelMm(request, posed_body) / posed_body.spacing_mm.minCoeff() + kRounding;
  int parts = 1;
  while (parts < 1 << request.level && 2 * parts <= most) {
    const Grid finer = DividedGrid(request, posed_body, 2 * parts);
    if (!PixelsAreFewEnough(finer) || !VoxelsAreFewEnough(finer, most_voxels)) break;
    parts *= 2;
  }
  return parts;
}

// Of one layer, over parts x parts pixels.
Volume Means(const Volume& layer, int parts) {
  Grid grid = Coarsened(layer.grid, parts);
  grid.origin = layer.grid.ToMm(PointVox{{(parts - 1) / 2.0, (parts - 1) / 2.0, 0}});
  Volume out(grid);
  for (size_t pixel = 0; pixel < out.values.size(); ++pixel) {
    const Eigen::Vector3i first = parts * grid.Ijk(pixel);
    double sum = 0;
    for (int j = 0; j < parts; ++j) {
      for (int i = 0; i < parts; ++i) sum += layer(first.x() + i, first.y() + j, 0);
    }
    out.values[pixel] = float(sum / (parts * parts));
  }
  return out;
}

}  // namespace

Grid SliceGrid(const SliceRequest& request, const Grid& posed_body) {
  const Grid grid = DividedGrid(request, posed_body, 1);
  RequireFewEnough(grid, kMostVoxels);
  return grid;
}

std::optional<RoomAcross> RoomBesidePlane(const SliceRequest& request, const Grid& posed_body) {
  const bool projects = request.projection != Projection::kNone;
  if (projects && !request.slab_mm) return {};
  const Frame frame = FrameOf(request);
  const Extent room = Along(posed_body, frame.into);
  const double depth = Depth(request, frame, room), half = projects ? *request.slab_mm / 2 : 0;
  if (depth + half >= room.least && depth - half <= room.most) return {};
  const bool backwards = !request.oblique && request.Axis() == SliceAxis::kSagittal;
  return backwards ? RoomAcross{-room.most, -room.least} : RoomAcross{room.least, room.most};
}

Volume PosedSlice(const PosingEngine& engine, const ResolvedPose& pose, const SliceRequest& request,
                  const std::optional<Grid>& posed_body) {
  const Grid body = posed_body ? *posed_body : engine.FittedGrid(pose);
  const Grid shown = SliceGrid(request, body);
  RequireFewEnough(shown, engine.most_voxels());
  const int parts = PartsOfAPixel(request, body, engine.most_voxels());
  Volume slab = engine.Pose(pose, parts == 1 ? shown : DividedGrid(request, body, parts)).volume;
  if (request.projection != Projection::kNone) slab = Projected(slab, request.projection);
  return parts == 1 ? std::move(slab) : Means(slab, parts);
}

}  // namespace kvx
