// Slices of volumes, windowed, with square pixels, superior (else anterior) up.
#include "pipeline/evaluate/pictures.h"

#include <algorithm>
#include <cmath>

#include "pipeline/io/atomic_file.h"
#include "pipeline/io/png_file.h"

namespace kvx {
namespace {

constexpr uint8_t kBackground = 96;
constexpr int kLeastPixels = 256;  // along a volume's longest side: coarse scans are enlarged
constexpr int kGap = 4;            // pixels between tiles

// Grey values from the 1st to the 99th percentile.
struct Window {
  float low = 0, high = 1;
  uint8_t operator()(float value) const {
    return uint8_t(std::lround(255 * std::clamp((value - low) / (high - low), 0.0f, 1.0f)));
  }
};

Window WindowOf(const Volume& volume) {
  std::vector<float> values;
  const size_t step = std::max<size_t>(1, volume.values.size() / 200000);
  for (size_t i = 0; i < volume.values.size(); i += step) values.push_back(volume.values[i]);
  std::sort(values.begin(), values.end());
  Window window{values[values.size() / 100], values[values.size() - 1 - values.size() / 100]};
  if (!(window.high > window.low)) window.high = window.low + 1;
  return window;
}

// A slice of one grid: the fixed axis and its index, and the two shown axes with their directions on the
// page.
struct Plane {
  int fixed = 2, across = 0, up = 1;
  double index = 0;
  bool flip_across = false, flip_up = false;
  int width = 1, height = 1;
  double pixel_mm = 1;
};

Plane PlaneThrough(const Grid& grid, int fixed, const PointMm& point) {
  Plane plane;
  plane.fixed = fixed;
  plane.across = (fixed + 1) % 3;
  plane.up = (fixed + 2) % 3;
  const auto upright = [&](int axis) {
    return std::abs(grid.direction(2, axis)) + 0.5 * std::abs(grid.direction(1, axis));
  };
  if (upright(plane.across) > upright(plane.up)) std::swap(plane.across, plane.up);
  const Eigen::Vector3d up = grid.direction.col(plane.up), across = grid.direction.col(plane.across);
  plane.flip_up = up.z() - 0.5 * up.y() < 0;  // superior, else anterior, at the top
  plane.flip_across = across.x() - 0.5 * across.y() < 0;
  plane.index = std::clamp(grid.ToVox(point).ijk[fixed], 0.0, double(grid.size[fixed] - 1));
  const double longest_mm = grid.size.cast<double>().cwiseProduct(grid.spacing_mm).maxCoeff();
  plane.pixel_mm = std::min(grid.spacing_mm.minCoeff(), longest_mm / kLeastPixels);
  plane.width =
      std::max(1, int(std::lround(grid.size[plane.across] * grid.spacing_mm[plane.across] / plane.pixel_mm)));
  plane.height =
      std::max(1, int(std::lround(grid.size[plane.up] * grid.spacing_mm[plane.up] / plane.pixel_mm)));
  return plane;
}

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

// One grey tile, row-major from the top left.
struct Tile {
  int width = 0, height = 0;
  std::vector<uint8_t> grey;
};

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

// Magenta where only `posed` is bright, green where only `scan` is; two equal tiles give a grey one.
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

// The place to look at: the mean of the joints' centres, or of the bones where no joint moves; moved with the
// bones.
PointMm Focus(const Model& model, const PoseVector* scan_from_template) {
  Eigen::Vector3d joints = Eigen::Vector3d::Zero(), bones = Eigen::Vector3d::Zero();
  int moving = 0;
  const auto moved = [&](int bone, const PointMm& x) {
    return scan_from_template ? ((*scan_from_template)[size_t(bone)] * x).lps : x.lps;
  };
  for (const Joint& joint : model.fit().skeleton.joints) {
    bones += moved(joint.child, model.bones().bones[size_t(joint.child)].centroid);
    if (joint.dofs.empty() || joint.parent == kNoParent) continue;
    joints += moved(joint.parent, joint.centre);
    ++moving;
  }
  return {moving ? joints / moving : bones / std::max(1, model.bones().size())};
}

struct Shown {
  const Volume &template_volume, &scan, &vbd, &registered;
  PointMm template_focus, scan_focus;
};

struct Row {
  Tile in_template, scan, vbd, registered;
  int Width() const { return in_template.width + 5 * (scan.width + kGap); }
  int Height() const { return std::max(in_template.height, scan.height); }
};

Row MakeRow(const Shown& shown, int axis, const Window& template_window, const Window& scan_window) {
  const Plane in_template = PlaneThrough(shown.template_volume.grid, axis, shown.template_focus);
  const Plane in_scan = PlaneThrough(shown.scan.grid, axis, shown.scan_focus);
  return {Slice(shown.template_volume, in_template, template_window), Slice(shown.scan, in_scan, scan_window),
          Slice(shown.vbd, in_scan, template_window), Slice(shown.registered, in_scan, template_window)};
}

void PaintRow(Picture& picture, int top, const Row& row) {
  int left = 0;
  Paint(picture, left, top, row.in_template);
  left += row.in_template.width + kGap;
  for (const Tile* tile : {&row.scan, &row.vbd, &row.registered}) {
    Paint(picture, left, top, *tile);
    left += tile->width + kGap;
  }
  for (const Tile* posed : {&row.vbd, &row.registered}) {
    Paint(picture, left, top, *posed, row.scan);
    left += posed->width + kGap;
  }
}

Picture Montage(const Shown& shown) {
  const Window template_window = WindowOf(shown.template_volume), scan_window = WindowOf(shown.scan);
  std::vector<Row> rows;
  int width = 0, height = 0;
  for (int axis = 0; axis < 3; ++axis) {
    rows.push_back(MakeRow(shown, axis, template_window, scan_window));
    width = std::max(width, rows.back().Width());
    height += rows.back().Height() + (axis ? kGap : 0);
  }
  Picture picture(width, height);
  std::fill(picture.rgb.begin(), picture.rgb.end(), kBackground);
  int top = 0;
  for (const Row& row : rows) {
    PaintRow(picture, top, row);
    top += row.Height() + kGap;
  }
  return picture;
}

}  // namespace

void WritePictures(const Model& model, const PosingEngine& engine, const std::filesystem::path& folder,
                   const Progress& progress) {
  std::filesystem::create_directories(folder);
  const PointMm template_focus = Focus(model, nullptr);
  for (size_t k = 0; k < model.scan_names().size(); ++k) {
    progress.Report("pictures", double(k) / double(model.scan_names().size()));
    const std::string& name = model.scan_names()[k];
    const Artifact<Scan> scan = model.LoadScanVolume(int(k));
    const ResolvedPose vbd = model.Resolve(ScanPose{name}, DeformationMode::kVbd);
    const ResolvedPose evd = model.Resolve(ScanPose{name}, DeformationMode::kEvd);
    const PosedVolume by_bones = engine.Pose(vbd, scan->volume.grid),
                      registered = engine.Pose(evd, scan->volume.grid);
    const Picture picture =
        Montage({model.template_scan().volume, scan->volume, by_bones.volume, registered.volume,
                 template_focus, Focus(model, &evd.scan_from_template)});
    AtomicFile file(folder / (name + ".png"));
    WritePng(file.temporary(), picture);
    file.Commit();
  }
}

}  // namespace kvx
