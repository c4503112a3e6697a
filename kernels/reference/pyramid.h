// CPU twin of kernels/pyramid.h.
#pragma once
#include "core/image.h"

namespace kvx::reference {

Volume Smoothed(const Volume& volume, const Eigen::Vector3i& reach = Eigen::Vector3i::Ones());
Volume Halved(const Volume& volume);

}  // namespace kvx::reference
