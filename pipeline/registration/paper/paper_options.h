// What can be chosen for the published registration method (Algorithm 1).
#pragma once
#include <cstdint>

#include "core/errors.h"

namespace kvx {

struct PaperOptions {
  int64_t version = 3;     // of the published method: raise it when its numbers change
  int64_t seed = 1;        // of the simplex's random restarts
  int64_t max_blocks = 0;  // registered per scan, worst first, over all levels; 0: all below the tolerance
  double max_seconds = 0;  // per scan; 0: no limit. What a time limit leaves depends on the machine
  int64_t run = 0;         // differs for every time-limited build, so that its results are never found again

  void Validate() const {
    if (seed < 0) throw InputError("the seed must be 0 or more");
    if (max_blocks < 0) throw InputError("the number of blocks must be 0 (all) or more");
    if (!(max_seconds >= 0)) throw InputError("the seconds must be 0 (no limit) or more");
  }
};
template <class A>
void Fields(A& a, PaperOptions& v) {
  a(v.version, v.seed, v.max_blocks, v.max_seconds, v.run);
}

}  // namespace kvx
