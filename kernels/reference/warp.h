// CPU twin of kernels/warp.h.
#pragma once
#include "core/image.h"

namespace kvx::reference {

Volume Warp(const Volume& moving, const DisplacementField& moving_from_fixed, const Mask& wanted,
            float outside = 0.0f);

}  // namespace kvx::reference
