// A motion turned into volumes or pictures, frame by frame on one grid.
#pragma once
#include "core/host/progress.h"
#include "pipeline/io/frame_sink.h"
#include "pipeline/io/png_file.h"
#include "pipeline/pictures/slice_tiles.h"
#include "pipeline/posing/key_frames.h"
#include "pipeline/posing/posed_slice.h"

namespace kvx {

// Holds every frame's posed body; on the template's lattice.
Grid AnimationGrid(const PosingEngine& engine, const Motion& motion, const KeyFrames& frames,
                   const Progress& progress = {});

// One posed volume per frame, all on `grid`, its resolution halved `level` times.
void AnimateVolumes(const PosingEngine& engine, const Motion& motion, const KeyFrames& frames,
                    const Grid& grid, int level, FrameSink<Volume>& sink, const Progress& progress = {});

// The window that is asked for, or the usual one. Slices share the template's, so that one looks like the
// next; a projection is brighter than any slice and takes the 1st to 99th percentile of what it shows.
Window ShownWindow(const SliceRequest& view, const Volume& layer, const Window& of_template);

// One slice or projection per frame, the same plane and the same grey values throughout:
// those that suit the first frame.
void AnimatePictures(const PosingEngine& engine, const Motion& motion, const KeyFrames& frames,
                     const Grid& grid, const SliceRequest& view, const Window& of_template,
                     FrameSink<GreyPicture>& sink, const Progress& progress = {});

// The first layer, windowed.
GreyPicture PictureOf(const Volume& layer, const Window& window);

}  // namespace kvx
