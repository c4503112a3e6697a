// Slices and montages.
#include "pipeline/pictures/slice_tiles.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace kvx {
namespace {

constexpr uint8_t kBackground = 96;
constexpr int kLeastPixels = 256;  // along a volume's longest side: coarse scans are enlarged
constexpr int kMostPixels = 4096;  // along the page's longest one: large scans beside fine ones stay small

}  // namespace

uint8_t Window::operator()(float value) const {
  return uint8_t(std::lround(255 * std::clamp((value - low) / (high - low), 0.0f, 1.0f)));
}

Window WindowOf(const Volume& volume) {
  std::vector<float> values;
  const size_t step = std::max<size_t>(1, volume.values.size() / 200000);
  for (size_t i = 0; i < volume.values.size(); i += step) values.push_back(volume.values[i]);
  std::sort(values.begin(), values.end());
  Window window{values[values.size() / 100], values[values.size() - 1 - values.size() / 100]};
  if (!(window.high > window.low)) window.high = window.low + 1;
  return window;
}

double PixelMmOf(const std::vector<Grid>& grids) {
  double least_mm = std::numeric_limits<double>::infinity(), longest_mm = 0;
  for (const Grid& grid : grids) {
    const double long_mm = grid.size.cast<double>().cwiseProduct(grid.spacing_mm).maxCoeff();
    least_mm = std::min({least_mm, grid.spacing_mm.minCoeff(), long_mm / kLeastPixels});
    longest_mm = std::max(longest_mm, long_mm);
  }
  return std::max(least_mm, longest_mm / kMostPixels);
}

Plane PlaneThrough(const Grid& grid, int fixed, const PointMm& point, double pixel_mm) {
  Plane plane;
  plane.fixed = fixed;
  plane.across = (fixed + 1) % 3;
  plane.up = (fixed + 2) % 3;
  const auto upright = [&](int axis) {
    return std::abs(grid.direction(2, axis)) + 0.5 * std::abs(grid.direction(1, axis));
  };
  if (upright(plane.across) > upright(plane.up)) std::swap(plane.across, plane.up);
  const Eigen::Vector3d up = grid.direction.col(plane.up), across = grid.direction.col(plane.across);
  plane.flip_up = up.z() - 0.5 * up.y() < 0;              // superior, else anterior, at the top
  plane.flip_across = across.x() + 0.5 * across.y() < 0;  // left, else posterior, on the right
  plane.index = std::clamp(grid.ToVox(point).ijk[fixed], 0.0, double(grid.size[fixed] - 1));
  plane.pixel_mm = pixel_mm;
  plane.width =
      std::max(1, int(std::lround(grid.size[plane.across] * grid.spacing_mm[plane.across] / plane.pixel_mm)));
  plane.height =
      std::max(1, int(std::lround(grid.size[plane.up] * grid.spacing_mm[plane.up] / plane.pixel_mm)));
  return plane;
}

namespace {

// Voxel position under a pixel of the page; row 0 is the top.
PointVox Under(const Plane& plane, const Grid& grid, int column, int row) {
  const auto along = [&](int axis, double pixel, bool flip) {
    const double vox = (pixel + 0.5) * plane.pixel_mm / grid.spacing_mm[axis] - 0.5;
    return std::clamp(flip ? grid.size[axis] - 1 - vox : vox, 0.0, double(grid.size[axis] - 1));
  };
  PointVox p;
  p.ijk[plane.fixed] = std::round(plane.index);
  p.ijk[plane.across] = along(plane.across, column, plane.flip_across);
  p.ijk[plane.up] = along(plane.up, plane.height - 1 - row, plane.flip_up);
  return p;
}

}  // namespace

Tile Slice(const Volume& volume, const Plane& plane, const Window& window) {
  Tile tile{plane.width, plane.height, {}};
  tile.grey.reserve(size_t(plane.width) * plane.height);
  for (int row = 0; row < plane.height; ++row) {
    for (int column = 0; column < plane.width; ++column) {
      tile.grey.push_back(
          window(SampleTrilinear(volume, Under(plane, volume.grid, column, row), window.low)));
    }
  }
  return tile;
}

void Paint(Picture& picture, int left, int top, const Tile& posed, const Tile& scan) {
  for (int y = 0; y < posed.height; ++y) {
    for (int x = 0; x < posed.width; ++x) {
      const size_t i = size_t(y) * posed.width + x;
      uint8_t* pixel = picture.At(left + x, top + y);
      pixel[0] = pixel[2] = posed.grey[i];
      pixel[1] = scan.grey[i];
    }
  }
}

void Paint(Picture& picture, int left, int top, const Tile& tile) { Paint(picture, left, top, tile, tile); }

namespace {

// The mean place of what is brighter than half the window: where the body is.
PointMm BrightCentre(const Volume& volume, const Window& window) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double count = 0;
  for (size_t i = 0; i < volume.values.size(); ++i) {
    if (window(volume.values[i]) < 128) continue;
    sum += volume.grid.Ijk(i).cast<double>();
    count += 1;
  }
  if (count == 0) return volume.grid.Middle();
  return volume.grid.ToMm(PointVox{sum / count});
}

}  // namespace

Picture BlankPage(int width, int height) {
  Picture picture(width, height);
  std::fill(picture.rgb.begin(), picture.rgb.end(), kBackground);
  return picture;
}

Picture SliceMontage(const std::vector<Volume>& volumes) {
  const PointMm centre = BrightCentre(volumes.at(0), WindowOf(volumes[0]));
  std::vector<Grid> grids;
  for (const Volume& volume : volumes) grids.push_back(volume.grid);
  const double pixel_mm = PixelMmOf(grids);
  std::vector<std::vector<Tile>> rows(3);
  int width = 0, height = 0;
  for (int axis = 0; axis < 3; ++axis) {
    int row_width = -kTileGap, row_height = 0;
    for (const Volume& volume : volumes) {
      const Plane plane = PlaneThrough(volume.grid, axis, centre, pixel_mm);
      rows[axis].push_back(Slice(volume, plane, WindowOf(volume)));
      row_width += rows[axis].back().width + kTileGap;
      row_height = std::max(row_height, rows[axis].back().height);
    }
    width = std::max(width, row_width);
    height += row_height + (axis ? kTileGap : 0);
  }
  Picture picture = BlankPage(width, height);
  int top = 0;
  for (const std::vector<Tile>& row : rows) {
    int left = 0, row_height = 0;
    for (const Tile& tile : row) {
      Paint(picture, left, top, tile);
      left += tile.width + kTileGap;
      row_height = std::max(row_height, tile.height);
    }
    top += row_height + kTileGap;
  }
  return picture;
}

}  // namespace kvx
