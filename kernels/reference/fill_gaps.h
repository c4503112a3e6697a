// CPU twin of kernels/fill_gaps.h.
#pragma once
#include "core/image.h"

namespace kvx::reference {

// `owner` as kernels/cl/evd_bricks.cl.h: 0xFFFFFFFF nobody, class in the two high bits, 0 = body.
void FillGaps(const std::vector<uint32_t>& owner, float air, Volume& values);

}  // namespace kvx::reference
