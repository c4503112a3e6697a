// A kind's name is stored with its jobs: never rename one.
#include "server/jobs/job_kinds.h"

#include <nlohmann/json.hpp>

#include "api/handlers/animations.h"
#include "api/handlers/bones.h"
#include "api/handlers/models.h"

namespace kvx {
namespace {

JobOutcome BuildModelJob(Services& services, const ClaimedJob& job, const Progress& progress) {
  const BuildTask task = TaskOf(services.blobs, job.model, job.request);
  const BuildOutcome built = services.builder.Build(task, progress);
  const Json result{{"model", task.model}, {"digest", built.digest}, {"warnings", built.warnings}};
  return {Dump(result),
          [&services, model = task.model, digest = built.digest] {
            services.catalogue.SetModelDigest(model, digest);
          },
          built.seconds};
}

JobOutcome AnimationJob(Services& services, const ClaimedJob& job, const Progress& progress) {
  return {MakeAnimation(services, job, progress), {}};
}

JobOutcome SegmentBonesJob(Services& services, const ClaimedJob& job, const Progress& progress) {
  MadeBones made = MakeBones(services, job.request, progress);
  return {std::move(made.result), std::move(made.record)};
}

using KindFunction = JobOutcome (*)(Services&, const ClaimedJob&, const Progress&);

RunJob Bound(Services& services, KindFunction run) {
  return [&services, run](const ClaimedJob& job, const Progress& progress) {
    return run(services, job, progress);
  };
}

}  // namespace

JobKinds AllJobKinds(Services& services) {
  return {
      {"build_model", Bound(services, BuildModelJob)},
      {"animation", Bound(services, AnimationJob)},
      {"segment_bones", Bound(services, SegmentBonesJob)},
  };
}

}  // namespace kvx
