// CPU twin of kernels/pyramid.h.
#pragma once
#include "core/image.h"

namespace kvx::reference {

Volume Smoothed(const Volume& volume);
Volume Halved(const Volume& volume);
std::vector<Eigen::Vector4f> ValueAndSlope(const Volume& volume);

}  // namespace kvx::reference
