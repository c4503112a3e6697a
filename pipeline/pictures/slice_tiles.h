// Slices of volumes as grey tiles: windowed, with square pixels, superior (else anterior) up.
#pragma once
#include <vector>

#include "core/image.h"
#include "pipeline/io/png_file.h"

namespace kvx {

constexpr int kTileGap = 4;  // pixels between tiles

// Grey values 0..255 between two intensities.
struct Window {
  float low = 0, high = 1;
  uint8_t operator()(float value) const;
};
Window WindowOf(const Volume& volume);  // 1st to 99th percentile

// A slice of one grid: the fixed axis and its index,
// and the two shown axes with their directions on the page.
struct Plane {
  int fixed = 2, across = 0, up = 1;
  double index = 0;
  bool flip_across = false, flip_up = false;
  int width = 1, height = 1;  // pixels
  double pixel_mm = 1;
};
// For all tiles of a page, so that a length has the same width in each.
double PixelMmOf(const std::vector<Grid>& grids);
Plane PlaneThrough(const Grid& grid, int fixed_axis, const PointMm& point, double pixel_mm);

// Row-major from the top left.
struct Tile {
  int width = 0, height = 0;
  std::vector<uint8_t> grey;
};
Tile Slice(const Volume& volume, const Plane& plane, const Window& window);

// Magenta where only `posed` is bright, green where only `scan` is; two equal tiles give a grey one.
void Paint(Picture& picture, int left, int top, const Tile& posed, const Tile& scan);
void Paint(Picture& picture, int left, int top, const Tile& tile);

Picture BlankPage(int width, int height);  // grey
// A row for each of the grid's three planes through the middle of
// what is bright in the first volume, a column per volume.
Picture SliceMontage(const std::vector<Volume>& volumes);

}  // namespace kvx
