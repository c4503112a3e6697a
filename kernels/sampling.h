// How a volume is read between its voxels: linear, or by Keys' cubic.
#pragma once

namespace kvx {

enum class Sampling { kLinear, kCubic };

}  // namespace kvx
