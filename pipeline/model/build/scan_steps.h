// Everything the stages of one training scan make.
#pragma once
#include <map>
#include <memory>
#include <string>

#include "core/study.h"
#include "pipeline/bones/refine_bones.h"
#include "pipeline/bones/register_bones.h"
#include "pipeline/examples/complete_example.h"
#include "pipeline/examples/compute_example.h"
#include "pipeline/examples/sample_example.h"
#include "pipeline/examples/shown_tissue.h"
#include "pipeline/measures/measure_scan.h"
#include "pipeline/model/build/step.h"
#include "pipeline/registration/register_scan.h"
#include "pipeline/scans/load_scan.h"
#include "pipeline/skeleton/settle_bones.h"

namespace kvx {

struct ScanSteps {
  const StudyScan& study;
  std::unique_ptr<Step<LoadScan>> scan;
  std::unique_ptr<Step<RegisterBones>> found;
  std::unique_ptr<Step<RefineBones>> refined;
  std::unique_ptr<Step<ScanBones>> fits;
  std::unique_ptr<Step<RegisterScan>> registered;
  std::unique_ptr<Step<ComputeExample>> example;
  std::unique_ptr<Step<ShownTissue>> shown;
  std::unique_ptr<Step<SampleExample>> samples;
  std::unique_ptr<Step<CompleteExample>> completed;  // only where a bone is in doubt
  std::unique_ptr<Step<MeasureScan>> measures;
};

// What the model takes of the scan.
const Digest& ExampleKey(const ScanSteps& steps);
std::shared_ptr<const DisplacementField> BorrowExample(ScanSteps& steps);

// Adds what they took to the seconds of the manifest.
void AddSeconds(const ScanSteps& steps, std::map<std::string, double>& seconds);

}  // namespace kvx
