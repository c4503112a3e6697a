// A bone that the evidence does not place for certain, and what a user can do about it.
#pragma once
#include <string>

#include "core/pose.h"

namespace kvx {

// `why`: a clause on "the bone".
inline void DoubtBone(BoneFit& fit, const std::string& why) {
  fit.doubt = Doubt::kBone;
  fit.note = why + "; check it and give an initial pose for it if it is wrong";
}

}  // namespace kvx
