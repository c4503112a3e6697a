// Muscle's intensity beside marrow's, which is the sequence's: half of it in most MR scans, an eighth in
// T2-weighted and fat images. There cortex can hardly be told from muscle by constants that hold elsewhere.
#pragma once
#include <optional>

#include "core/host/own_or_lent.h"
#include "core/image.h"

namespace kvx {

constexpr double kUsualMuscle = 0.47;  // of marrow, with which the search tells cortex from muscle well

// Of soft tissue around the strokes' bones that is darker than marrow, and farther across than cortex ever
// is: the median of its intensity, in parts of marrow's. None where there is hardly any. `scan`: 0 where
// there is no signal.
std::optional<double> MuscleLevel(const Volume& scan, const LabelMap& strokes);

struct UsualMuscle {
  OwnOrLent<Volume> scan;  // lent where muscle is as bright as usual, or brighter
  double darker = 0;       // that it was, from 0 (as usual) to 1 (black)
};

// With muscle as bright as usual: what is up to as bright as muscle times one factor, marrow and what is
// brighter as it was, between them in proportion.
UsualMuscle WithUsualMuscle(const Volume& scan, const LabelMap& strokes);

}  // namespace kvx
