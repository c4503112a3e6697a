// Montages of a model beside its scans.
#include "pipeline/evaluate/pictures.h"

#include <algorithm>

#include "pipeline/io/atomic_file.h"
#include "pipeline/pictures/slice_tiles.h"

namespace kvx {
namespace {

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
  int Width() const { return in_template.width + 5 * (scan.width + kTileGap); }
  int Height() const { return std::max(in_template.height, scan.height); }
};

Row MakeRow(const Shown& shown, int axis, const Window& template_window, const Window& scan_window) {
  const Grid &template_grid = shown.template_volume.grid, &scan_grid = shown.scan.grid;
  const double pixel_mm = PixelMmOf({template_grid, scan_grid});
  const Plane in_template = PlaneThrough(template_grid, axis, shown.template_focus, pixel_mm);
  const Plane in_scan = PlaneThrough(scan_grid, axis, shown.scan_focus, pixel_mm);
  return {Slice(shown.template_volume, in_template, template_window), Slice(shown.scan, in_scan, scan_window),
          Slice(shown.vbd, in_scan, template_window), Slice(shown.registered, in_scan, template_window)};
}

void PaintRow(Picture& picture, int top, const Row& row) {
  int left = 0;
  Paint(picture, left, top, row.in_template);
  left += row.in_template.width + kTileGap;
  for (const Tile* tile : {&row.scan, &row.vbd, &row.registered}) {
    Paint(picture, left, top, *tile);
    left += tile->width + kTileGap;
  }
  for (const Tile* posed : {&row.vbd, &row.registered}) {
    Paint(picture, left, top, *posed, row.scan);
    left += posed->width + kTileGap;
  }
}

Picture Montage(const Shown& shown) {
  const Window template_window = WindowOf(shown.template_volume), scan_window = WindowOf(shown.scan);
  std::vector<Row> rows;
  int width = 0, height = 0;
  for (int axis = 0; axis < 3; ++axis) {
    rows.push_back(MakeRow(shown, axis, template_window, scan_window));
    width = std::max(width, rows.back().Width());
    height += rows.back().Height() + (axis ? kTileGap : 0);
  }
  Picture picture = BlankPage(width, height);
  int top = 0;
  for (const Row& row : rows) {
    PaintRow(picture, top, row);
    top += row.Height() + kTileGap;
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
