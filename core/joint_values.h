// The values of a joint's degrees of freedom: turns about up to three axes and, of a joint with six, shifts
// along the same axes. Where turns are degrees (files, requests), shifts are millimetres; inside, both are
// multiplied by pi/180, so that in pose space a millimetre counts as much as a degree.
#pragma once
#include <algorithm>

#include "core/frames.h"

namespace kvx {

constexpr int kMostTurns = 3, kTurnsAndShifts = 6;

inline int TurnsAmong(size_t dofs) { return std::min(int(dofs), kMostTurns); }
inline bool IsShift(size_t place_in_joint) { return place_in_joint >= size_t(kMostTurns); }
constexpr double ShiftMm(double value) { return DegFromRad(value); }
constexpr double ValueOfShift(double shift_mm) { return RadFromDeg(shift_mm); }

}  // namespace kvx
