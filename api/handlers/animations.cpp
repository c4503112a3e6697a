// A job's request holds all that makes its file; equal requests share one file.
#include "api/handlers/animations.h"

#include <nlohmann/json.hpp>

#include "api/handlers/slice_query.h"
#include "core/errors.h"

namespace kvx {
namespace {

constexpr const char* kAnimationKind = "animation";

const char* AnimationType(const std::string& format) {
  return format == "nii.gz" ? "application/gzip"
         : format == "mp4"  ? "video/mp4"
         : format == "webm" ? "video/webm"
                            : "application/octet-stream";
}

// Results of a model start with its id, so that they go with it.
std::string AnimationName(const AnimationTask& task, const Digest& digest) {
  return task.model + "." + digest.Hex() + "." + task.format;
}

Json Stored(const AnimationTask& task) {
  const auto number = [](const std::optional<double>& value) { return value ? Json(*value) : Json(); };
  Json view{{"axis", task.view.axis ? NameOf(*task.view.axis) : ""},
            {"projection", NameOf(task.view.projection)},
            {"mm", number(task.view.at_mm)},
            {"width", number(task.view.width_mm)},
            {"height", number(task.view.height_mm)},
            {"pixel", number(task.view.pixel_mm)},
            {"slab", number(task.view.slab_mm)}};
  if (task.view.window) view["window"] = {task.view.window->first, task.view.window->second};
  if (task.view.oblique) {
    for (const Eigen::Vector3d& x : task.view.oblique->Vectors())
      view["oblique"].push_back({x.x(), x.y(), x.z()});
  }
  return {{"key_frames", task.key_frames},
          {"mode", NameOf(task.mode)},
          {"level", task.view.level},
          {"format", task.format},
          {"view", view}};
}

AnimationTask AnimationTaskOf(const std::string& model, const std::string& stored_request) {
  const Json stored = Json::parse(stored_request);
  AnimationTask task;
  task.model = model;
  task.key_frames = stored["key_frames"].get<std::string>();
  task.mode = DeformationModeFromName(stored["mode"].get<std::string>());
  task.view.level = stored["level"].get<int>();
  task.format = stored["format"].get<std::string>();
  const Json& view = stored["view"];
  const auto number = [&](const char* name) {
    return view[name].is_null() ? std::nullopt : std::optional(view[name].get<double>());
  };
  if (const auto axis = view["axis"].get<std::string>(); !axis.empty())
    task.view.axis = SliceAxisFromName(axis);
  task.view.projection = ProjectionFromName(view["projection"].get<std::string>());
  task.view.at_mm = number("mm"), task.view.width_mm = number("width"),
  task.view.height_mm = number("height");
  task.view.pixel_mm = number("pixel"), task.view.slab_mm = number("slab");
  using Numbers = std::vector<double>;
  if (view.contains("window")) task.view.window = WindowOf(view["window"].get<Numbers>());
  if (view.contains("oblique")) {
    const auto vectors = view["oblique"].get<std::vector<Numbers>>();
    task.view.oblique = ObliqueOf(vectors.at(0), vectors.at(1), vectors.at(2));
  }
  return task;
}

// Most of a document that is indented for people is blanks. A table is kept as it came.
std::string WithoutBlanks(const std::string& key_frames) {
  const size_t begin = key_frames.find_first_not_of(" \t\r\n");
  const bool json = begin != key_frames.npos && key_frames[begin] == '{';
  return json ? Dump(ParseBody(key_frames)) : key_frames;
}

// What a picture's parameters cannot do for this animation is refused rather than left out.
void RequireFitting(const AnimationTask& task) {
  const bool volumes = task.format == "nii" || task.format == "nii.gz";
  if (volumes && !task.view.Empty())
    throw InputError("plane, projection, size and window are for mp4 and webm; volumes show everything");
  if (!volumes) task.view.OfVideo().Validate();
}

}  // namespace

Answer CreateAnimation(Services& services, const std::string& model, const Query& query,
                       const std::string& body, const std::string& idempotency_key) {
  RequireKnown(query, kSliceParameters);
  std::string asked;
  for (const auto& [name, value] : query) asked += name + "=" + value + "&";
  const RequestKey key = KeyOf("POST /v1/models/" + model + "/animations", idempotency_key, {asked, body});
  if (auto answer = services.idempotency.Find(key)) return *answer;
  AnimationTask task;
  task.model = model;
  task.key_frames = body;
  task.mode = PosedQueryOf(services, model, query, kSliceParameters, "").mode;
  task.format = FormatAmong(query, {"nii.gz", "nii", "mp4", "webm"}, "an animation");
  task.view = ViewOf(query);
  RequireFitting(task);
  RequireBuilt(services, model);
  RequireFewValues(body);
  services.poser.CheckAnimation(task);
  task.key_frames = WithoutBlanks(body);
  const std::string stored = Dump(Stored(task));
  const Answer answer = services.idempotency.Once(key, [&]() -> Answer {
    NewJob wanted{kAnimationKind, model, stored};
    wanted.subject = services.catalogue.RequireModel(model).subject;  // it may be removed by now
    const JobRecord job = services.jobs.Submit(wanted);
    return {202, "/v1/jobs/" + job.id, Dump(Json{{"job", job.id}, {"model", model}, {"state", job.state}})};
  });
  services.jobs.WakeAll();
  return answer;
}

FileAnswer GetAnimation(Services& services, const std::string& model, const std::string& job_id,
                        const Conditions& conditions) {
  const JobRecord job = services.jobs.Require(job_id);
  if (job.kind != kAnimationKind || job.model != model)
    throw NotFound("this model has no animation of this id");
  if (job.state != "succeeded") throw Conflict("the animation is not there: its job is " + job.state);
  const AnimationTask task = AnimationTaskOf(model, services.jobs.RequestOf(job_id));
  const std::string kept =
      Json::parse(job.result.value_or("{}")).value("digest", "");  // older jobs have none
  const Digest digest = kept.empty() ? services.poser.CheckAnimation(task).digest : Digest::FromHex(kept);
  return AnswerWith(digest, conditions, AnimationType(task.format), job_id + "." + task.format, [&] {
    auto file = services.results.Find(AnimationName(task, digest));
    if (!file) throw NotFound("the animation is no longer kept; post it again");
    return file;
  });
}

std::string MakeAnimation(Services& services, const ClaimedJob& job, const Progress& progress) {
  const AnimationTask task = AnimationTaskOf(job.model, job.request);
  const AnimationFacts facts = services.poser.CheckAnimation(task);
  const std::string name = AnimationName(task, facts.digest);
  // A worker's results are its own, but for the animations
  if (!services.results.Find(name) && !services.poser.HasAnimation(name)) {
    services.poser.WriteAnimation(task, name, progress);
    services.results.Find(name);  // it counts from now on
  }
  return Dump(Json{{"content", "/v1/models/" + job.model + "/animations/" + job.id},
                   {"model", job.model},
                   {"frames", facts.frames},
                   {"format", task.format},
                   {"digest", facts.digest.Hex()}});
}

}  // namespace kvx
