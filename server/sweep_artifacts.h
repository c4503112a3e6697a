// Artefacts that no model names any more: removed after a model was deleted, as soon as no build runs.
#pragma once
#include "storage/files/data_folder.h"

namespace kvx {

void WantSweep(const DataFolder& data);       // remembered on disk until it is done
void SweepArtifacts(const DataFolder& data);  // when wanted and no build runs, in this process or another

// Held by a build: no sweep meanwhile. Tries one that is wanted when the build has ended.
class SweepAfterwards {
 public:
  explicit SweepAfterwards(const DataFolder& data);
  ~SweepAfterwards();
  SweepAfterwards(const SweepAfterwards&) = delete;
  SweepAfterwards& operator=(const SweepAfterwards&) = delete;

 private:
  const DataFolder& data_;
  int lock_ = -1;
};

}  // namespace kvx
