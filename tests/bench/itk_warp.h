// ITK's WarpImageFilter with a ready-made field, for comparison: what it does is the last of the steps of a
// pose.
#pragma once
#include <memory>

#include "core/image.h"

namespace kvx {

class ItkWarp {
 public:
  // `template_from_posed`: displacements on the posed grid, mm.
  ItkWarp(const Volume& image, const DisplacementField& template_from_posed, int threads);
  ~ItkWarp();
  float Run();  // one value of what it makes

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace kvx
