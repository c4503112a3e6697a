// A magnitude image without the slow shading that coils lay over it.
#pragma once
#include "core/scan.h"

namespace kvx {

// Values above that of air are divided by their mean over a wide neighbourhood, and brought back to the mean
// of all. Whatever shades an image slowly goes; so does a slow change of tissue, alike in template and scan.
// Scans with values far below zero (CT) have no coil, and without air nobody knows what dark is: they stay as
// they are.
Volume EvenlyLit(const Scan& scan);

}  // namespace kvx
