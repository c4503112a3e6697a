// Registration of two volumes alone, without bones: from a rigid start, as the paper's Table 2 does it.
#pragma once
#include "pipeline/registration/register_scan.h"

namespace kvx {

// The body is found in the template; all of it may move. `start`: scan_from_template.
RegisteredScan RegisterVolumes(const Scan& template_scan, const Scan& scan, const RigidTransform& start,
                               const RegisterScan::Options& options, StageContext& context);

}  // namespace kvx
