// Bones of an MR scan looked for from their strokes, with and without a shell, each by itself but for the
// colours they share.
#pragma once
#include "core/host/progress.h"
#include "pipeline/segmentation/mr/search/stroke_bone.h"
#include "pipeline/segmentation/strokes/found_bone.h"

namespace kvx {

// For each bone one answer, and a second one where the search asks for the shell. `air`: 1 where no bone is,
// whatever it looks like.
std::vector<std::vector<FoundBone>> CutBonesFromStrokes(const Volume& scan, const LabelMap& strokes,
                                                        const LabelMap& air,
                                                        const std::vector<StrokeBox>& boxes,
                                                        const StrokeSearch& search, const Progress& progress);

}  // namespace kvx
