// Runs a stage, or finds what it made before. What a stage is:
// clang-format off
//   struct MakeSomething {
//     static constexpr std::string_view kName = "something";  // of its artefacts, its progress and its seconds
//     static constexpr int kVersion = 1;                      // raise it when the numbers change
//     struct Inputs { ...; std::vector<Digest> Keys() const; };  // keys of the artefacts it reads, in order
//     struct Options { ... };                                 // with an overload of Fields()
//     using Output = ...;                                     // with an overload of Fields()
//     static Output Run(const Inputs&, const Options&, StageContext&);  // pure: no clock, globals or logging
//   };
// clang-format on
#pragma once
#include "core/host/progress.h"
#include "kernels/device/backend.h"
#include "pipeline/artifacts/core_fields.h"
#include "pipeline/artifacts/stage_cache.h"

namespace kvx {

struct StageContext {
  Backend& backend;
  Progress progress;  // 0..1 of this stage; Report throws Cancelled when the job is cancelled
};

// Options without fields.
struct NoOptions {};
template <class A>
void Fields(A&, NoOptions&) {}

template <class Stage>
Digest StageKey(const typename Stage::Inputs& inputs, const typename Stage::Options& options,
                const Backend& backend) {
  Hasher hasher;
  hasher.Add("stage").Add(Stage::kName).Add("version").Add(int64_t(Stage::kVersion));
  hasher.Add("numerics").Add(backend.numerics()).Add("inputs");
  for (const Digest& key : inputs.Keys()) hasher.Add(key);
  hasher.Add("options");
  FieldHasher fields(hasher);
  typename Stage::Options copy = options;
  fields(copy);
  return hasher.Finish();
}

template <class T>
std::optional<Artifact<T>> FindArtifact(const StageCache& cache, const Digest& key) {
  const auto bytes = cache.Read(key);
  if (!bytes) return std::nullopt;
  auto value = std::make_shared<T>();
  try {
    ByteReader reader(bytes->view());
    reader(*value);
  } catch (const Unavailable&) {
    return std::nullopt;  // damaged: made again
  }
  return Artifact<T>{key, std::move(value)};
}

// Throws Unavailable when the device fails.
template <class Stage>
std::shared_ptr<typename Stage::Output> OutputOf(const typename Stage::Inputs& inputs,
                                                 const typename Stage::Options& options,
                                                 StageContext& context) try {
  return std::make_shared<typename Stage::Output>(Stage::Run(inputs, options, context));
} catch (const cl::Error& failure) {
  throw Unavailable(DescribeFailure(failure));
}

template <class Stage>
Artifact<typename Stage::Output> RunStage(const StageCache& cache, const typename Stage::Inputs& inputs,
                                          const typename Stage::Options& options, Backend& backend,
                                          const Progress& progress) {
  const Digest key = StageKey<Stage>(inputs, options, backend);
  progress.Report(Stage::kName, 0.0);
  if (auto found = FindArtifact<typename Stage::Output>(cache, key)) return *std::move(found);
  StageContext context{backend, progress};
  auto value = OutputOf<Stage>(inputs, options, context);
  cache.Write(key, BytesOf(*value).view());
  progress.Report(Stage::kName, 1.0);
  return {key, std::move(value)};
}

}  // namespace kvx
