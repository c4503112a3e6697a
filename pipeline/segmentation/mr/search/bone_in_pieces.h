// A bone that is several, each in a wall of its own (the carpal bones, taken for one): pieces that hardly a
// stroke lies in, and the pieces without what leaked out between them.
#pragma once
#include "pipeline/segmentation/strokes/found_bone.h"

namespace kvx {

struct MarkedScan {
  const Volume& scan;
  const Volume& calm;       // what surfaces are judged by (noisy_scan.h)
  const LabelMap& strokes;  // bones and kBackgroundStroke
  const LabelMap& air;      // 1 in air
};

struct BoneInPieces {
  std::vector<FoundBone> answers;  // beside the bone itself; none where it is one
  int unmarked = 0;                // pieces in them that are new and that no stroke lies in
};

// A bone is in pieces where walls part what its strokes mark. Its pieces lie in closed walls in or beside
// what was found, hold no stroke of another bone or of the background, and have as clear a surface. The
// answers: with the pieces, and with them but without what neither is one nor has strokes. `found`: labels of
// all bones found so far, on the scan's grid; `marrow_level`: intensity of marrow; `clear_rise`: the
// OutwardRise of a piece's surface.
BoneInPieces AnswersInPieces(const MarkedScan& marked, const FoundBone& bone, const LabelMap& found,
                             double marrow_level, double clear_rise);

}  // namespace kvx
