// The published method as a registration of one scan: VBD, Algorithm 1, and back to the template (eq. 7's
// v-hat).
#pragma once
#include "core/registered_scan.h"
#include "pipeline/registration/paper/register_as_published.h"
#include "pipeline/registration/region/registration_inputs.h"
#include "pipeline/runner.h"

namespace kvx {

RegisteredScan RegisterByPaper(const RegistrationInputs& inputs, const PaperOptions& options,
                               StageContext& context);

// scan_from_template of template points that `initial` puts to y, where the source of the registered scan was
// read at p + shifts(p): the p with p + shifts(p) = y.
DisplacementField ThroughShifts(const DisplacementField& initial, const VoxelShifts& shifts);

}  // namespace kvx
