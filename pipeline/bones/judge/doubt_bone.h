// A bone that the evidence does not place for certain, and what a user can do about it.
#pragma once
#include <string>
#include <string_view>

#include "core/pose.h"

namespace kvx {

inline constexpr std::string_view kGivePose = "; check it and give an initial pose for it if it is wrong";

// `why`: a clause on "the bone".
inline void DoubtBone(BoneFit& fit, const std::string& why) {
  fit.doubt = Doubt::kBone;
  fit.note = why + std::string(kGivePose);
}

// Of a bone that lies by its initial pose: whoever gave one need not give it once more.
inline void TellOfHint(BoneFit& fit) {
  if (!fit.note.ends_with(kGivePose)) return;
  fit.note.resize(fit.note.size() - kGivePose.size());
  fit.note +=
      "; it lies about where its initial pose has it, which alone decides what the scan does not: check it";
}

}  // namespace kvx
