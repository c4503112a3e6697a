// One stage of a build, known by its key at once: its value is found or made when somebody needs it, and can
// be let go again. A build whose stages are all finished therefore reads no voxels.
#pragma once
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>

#include "pipeline/runner.h"

namespace kvx {

// Seconds it took to make an artefact, kept beside it: a later build that finds the artefact still knows its
// cost.
inline Digest SecondsKey(const Digest& artifact) { return Hasher().Add("seconds").Add(artifact).Finish(); }
inline double SecondsOf(const StageCache& cache, const Digest& artifact) {
  const auto found = FindArtifact<double>(cache, SecondsKey(artifact));
  return found ? **found : 0.0;
}
inline void StoreSeconds(const StageCache& cache, const Digest& artifact, double seconds) {
  cache.WriteUnsynced(SecondsKey(artifact), BytesOf(seconds).view());
}

// Reports under `name` whatever the stage calls itself ("register pose01"); what follows a colon stays.
inline Progress Named(const Progress& progress, std::string name) {
  return Progress(
      [progress, name = std::move(name)](std::string_view stage, double fraction) {
        const size_t colon = std::min(stage.find(':'), stage.size());
        progress.Report(name + std::string(stage.substr(colon)), fraction);
      },
      [progress] { return progress.IsCancelled(); });  // a silent view of it stops, too
}

template <class Stage>
class Step {
 public:
  using Output = typename Stage::Output;
  // `inputs` refers to artefacts of other steps, which must outlive this one. `need` loads their values.
  // Several threads may make and load at once; nobody may let go what another still uses.
  Step(const StageCache& cache, Backend& backend, typename Stage::Inputs inputs,
       typename Stage::Options options, std::function<void()> need)
      : cache_(cache),
        backend_(backend),
        inputs_(std::move(inputs)),
        options_(std::move(options)),
        need_(std::move(need)),
        artifact_{StageKey<Stage>(inputs_, options_, backend_), nullptr} {}
  Step(const Step&) = delete;
  Step& operator=(const Step&) = delete;

  const Digest& key() const { return artifact_.key; }
  std::vector<Digest> InputKeys() const { return inputs_.Keys(); }
  const Artifact<Output>& artifact() const { return artifact_; }  // its value is there after Load
  void Release() { artifact_.value.reset(); }

  // Leaves the finished artefact in the cache, its value not necessarily loaded.
  void Make(const Progress& progress) {
    progress.Report(Stage::kName, 0.0);
    {
      const std::lock_guard lock(mutex_);
      if (!artifact_.value && !cache_.Intact(key())) Run(progress);
    }
    progress.Report(Stage::kName, 1.0);
  }
  const Output& Load(const Progress& progress = {}) {
    const std::lock_guard lock(mutex_);
    if (!artifact_.value) {
      if (auto found = FindArtifact<Output>(cache_, key()))
        artifact_.value = std::move(found->value);
      else
        Run(progress);
    }
    return *artifact_.value;
  }
  // For one who holds it alone.
  std::shared_ptr<const Output> Borrow() {
    Load();
    const std::shared_ptr<const Output> value = artifact_.value;
    Release();
    return value;
  }
  double Seconds() const { return SecondsOf(cache_, key()); }

 private:
  void Run(const Progress& progress) {
    need_();
    const auto start = std::chrono::steady_clock::now();
    artifact_.value = RunStage<Stage>(cache_, inputs_, options_, backend_, progress).value;
    StoreSeconds(cache_, key(),
                 std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count());
  }

  const StageCache& cache_;
  Backend& backend_;
  typename Stage::Inputs inputs_;
  typename Stage::Options options_;
  std::function<void()> need_;
  Artifact<Output> artifact_;  // its key is never written again: others read it meanwhile
  std::mutex mutex_;           // of its value while that is made or loaded
};

// A step that takes what other steps make, all of it, in the order of its inputs.
template <class Stage, class... Made>
std::unique_ptr<Step<Stage>> MakeStep(const StageCache& cache, Backend& backend,
                                      typename Stage::Options options, Made&... made) {
  return std::make_unique<Step<Stage>>(cache, backend, typename Stage::Inputs{made.artifact()...},
                                       std::move(options), [&made...] { (made.Load(), ...); });
}

}  // namespace kvx
