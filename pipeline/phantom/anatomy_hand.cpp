// placeholder
#include "pipeline/phantom/anatomy.h"
namespace kvx::phantom { Anatomy MakeHand(uint64_t seed) { return MakeKnee(seed); } }
