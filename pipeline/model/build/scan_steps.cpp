// The names are those of the model's manifest, which holds one number for several stages.
#include "pipeline/model/build/scan_steps.h"

namespace kvx {

const Digest& ExampleKey(const ScanSteps& steps) {
  return steps.completed ? steps.completed->key() : steps.example->key();
}

std::shared_ptr<const DisplacementField> BorrowExample(ScanSteps& steps) {
  return steps.completed ? steps.completed->Borrow() : steps.example->Borrow();
}

void AddSeconds(const ScanSteps& steps, std::map<std::string, double>& seconds) {
  seconds["load"] += steps.scan->Seconds();
  seconds["register_bones"] += steps.found->Seconds() + steps.refined->Seconds() + steps.fits->Seconds();
  seconds["register"] += steps.registered->Seconds();
  seconds["examples"] += steps.shown->Seconds() + steps.example->Seconds() + steps.samples->Seconds();
  if (steps.completed) seconds["examples"] += steps.completed->Seconds();
  seconds["measures"] += steps.measures->Seconds();
}

}  // namespace kvx
