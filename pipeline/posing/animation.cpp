// Two passes over the frames: how much room they need, then the frames themselves.
#include "pipeline/posing/animation.h"

#include <future>

namespace kvx {

Grid AnimationGrid(const PosingEngine& engine, const Motion& motion, const KeyFrames& frames,
                   const Progress& progress) {
  Grid lattice;
  Eigen::Vector3d lo = Eigen::Vector3d::Zero(), hi = lo;
  for (int f = 0; f < frames.FrameCount(); ++f) {
    progress.Report("room", double(f) / frames.FrameCount());
    const Grid fitted = engine.FittedGrid(motion.At(frames.TimeOf(f)));
    if (f == 0) {
      lattice = fitted;
      hi = fitted.size.cast<double>();
      continue;
    }
    const Eigen::Vector3d first = lattice.ToVox(fitted.origin).ijk.array().round();
    lo = lo.cwiseMin(first), hi = hi.cwiseMax(first + fitted.size.cast<double>());
  }
  Grid out = lattice;
  out.origin = lattice.ToMm(PointVox{lo});
  out.size = (hi - lo).cast<int>();
  return out;
}

// One frame is written while the next is posed.
void AnimateVolumes(const PosingEngine& engine, const Motion& motion, const KeyFrames& frames,
                    const Grid& grid, int level, FrameSink<Volume>& sink, const Progress& progress) {
  PosedVolume posed[2];
  std::future<void> written;  // below the volumes: whatever ends this function waits for it first
  for (int f = 0; f < frames.FrameCount(); ++f) {
    progress.Report("frames", double(f) / frames.FrameCount());
    PosedVolume& next = posed[f % 2];
    engine.PoseInto(next, motion.At(frames.TimeOf(f)), grid, level);
    if (written.valid()) written.get();
    written = std::async(std::launch::async, [&sink, &next] { sink.Add(next.volume); });
  }
  if (written.valid()) written.get();
  sink.Finish();
}

Window ShownWindow(const SliceRequest& view, const Volume& layer, const Window& of_template) {
  if (view.window) return {float(view.window->first), float(view.window->second)};
  return view.projection == Projection::kNone ? of_template : WindowOf(layer);
}

void AnimatePictures(const PosingEngine& engine, const Motion& motion, const KeyFrames& frames,
                     const Grid& grid, const SliceRequest& view, const Window& of_template,
                     FrameSink<GreyPicture>& sink, const Progress& progress) {
  std::optional<Window> shown;
  for (int f = 0; f < frames.FrameCount(); ++f) {
    progress.Report("frames", double(f) / frames.FrameCount());
    const Volume layer = PosedSlice(engine, motion.At(frames.TimeOf(f)), view, grid);
    if (!shown) shown = ShownWindow(view, layer, of_template);
    sink.Add(PictureOf(layer, *shown));
  }
  sink.Finish();
}

GreyPicture PictureOf(const Volume& layer, const Window& window) {
  GreyPicture out{layer.grid.size.x(), layer.grid.size.y(), {}};
  const size_t pixels = size_t(out.width) * size_t(out.height);
  for (size_t p = 0; p < pixels; ++p) out.grey.push_back(window(layer.values[p]));
  return out;
}

}  // namespace kvx
