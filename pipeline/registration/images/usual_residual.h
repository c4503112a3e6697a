// How well images match where they are registered.
#pragma once

namespace kvx {

// Squared residual per weight of well registered tissue, a quarter of which shows less: smoothing takes most
// of the noise, and edges rarely err fully.
constexpr double kUsualResidual = 0.1;

}  // namespace kvx
