// The names are those of the model's manifest, which holds one number for several stages.
#include "pipeline/model/scan_steps.h"

namespace kvx {

void AddSeconds(const ScanSteps& steps, std::map<std::string, double>& seconds) {
  seconds["load"] += steps.scan->Seconds();
  seconds["register_bones"] += steps.found->Seconds() + steps.refined->Seconds() + steps.fits->Seconds();
  seconds["register"] += steps.registered->Seconds();
  seconds["examples"] += steps.example->Seconds() + steps.samples->Seconds();
  seconds["measures"] += steps.measures->Seconds();
}

}  // namespace kvx
