// A slice or surface is made while the client waits;
// an animation is a job whose file is kept among the results.
#include "api/handlers/products.h"

#include <nlohmann/json.hpp>

#include "core/errors.h"

namespace kvx {
namespace {

constexpr const char* kAnimationKind = "animation";
const std::initializer_list<std::string_view> kSliceParameters = {
    "axis",   "mm",       "centre",    "right",    "down",   "projection", "slab_mm",
    "window", "width_mm", "height_mm", "pixel_mm", "format", "mode",       "level"};

std::vector<double> Numbers(const Query& query, const std::string& name, size_t count) {
  std::vector<double> numbers;
  std::string_view rest;
  const std::string text = QueryValue(query, name);
  for (rest = text; !rest.empty();) {
    const size_t end = std::min(rest.find(','), rest.size());
    numbers.push_back(ParseNumber(rest.substr(0, end), "'" + name + "'"));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  if (!numbers.empty() && numbers.size() != count)
    throw InputError("'" + name + "' is " + std::to_string(count) + " numbers with commas between them");
  return numbers;
}

SliceView ViewOf(const Query& query) {
  SliceView view;
  view.at_mm = QueryNumber(query, "mm"), view.slab_mm = QueryNumber(query, "slab_mm");
  view.width_mm = QueryNumber(query, "width_mm"), view.height_mm = QueryNumber(query, "height_mm");
  view.pixel_mm = QueryNumber(query, "pixel_mm");
  view.axis = QueryValue(query, "axis", "axial"), view.projection = QueryValue(query, "projection", "none");
  const auto centre = Numbers(query, "centre", 3), right = Numbers(query, "right", 3),
             down = Numbers(query, "down", 3);
  if (!centre.empty() || !right.empty() || !down.empty()) {
    if (centre.empty() || right.empty() || down.empty())
      throw InputError("an oblique plane needs 'centre', 'right' and 'down'");
    if (query.contains("axis") || view.at_mm)
      throw InputError("give 'axis' and 'mm', or an oblique plane, not both");
    view.oblique = {Eigen::Vector3d(centre.data()), Eigen::Vector3d(right.data()),
                    Eigen::Vector3d(down.data())};
  }
  const auto window = Numbers(query, "window", 2);
  if (!window.empty()) {
    if (!(window[1] > window[0]))
      throw InputError("'window' is the intensities shown black and white, the lower first");
    view.window = {window[0], window[1]};
  }
  return view;
}

void AddView(Hasher& hasher, const SliceView& view) {
  const auto add = [&](const std::optional<double>& value) {
    hasher.Add(int64_t(value.has_value())).Add(value.value_or(0));
  };
  hasher.Add(view.axis).Add(view.projection);
  for (const auto& value : {view.at_mm, view.width_mm, view.height_mm, view.pixel_mm, view.slab_mm})
    add(value);
  hasher.Add(int64_t(view.oblique.has_value()));
  for (int v = 0; view.oblique && v < 3; ++v) {
    for (const double number : (*view.oblique)[size_t(v)]) hasher.Add(number);
  }
  add(view.window ? std::optional(view.window->first) : std::nullopt);
  add(view.window ? std::optional(view.window->second) : std::nullopt);
}

struct SliceFormatName {
  std::string_view name;
  SliceFormat format;
  const char* content_type;
};
constexpr SliceFormatName kSliceFormats[] = {{"png", SliceFormat::kPng, "image/png"},
                                             {"nii.gz", SliceFormat::kNiftiGz, "application/gzip"},
                                             {"nrrd", SliceFormat::kNrrd, "application/octet-stream"}};

const SliceFormatName& SliceFormatOf(const Query& query) {
  const std::string wanted = QueryValue(query, "format", "png");
  for (const SliceFormatName& format : kSliceFormats) {
    if (format.name == wanted) return format;
  }
  throw InputError("'format' of a slice is png, nii.gz or nrrd");
}

SurfaceParts PartsOf(const Query& query) {
  SurfaceParts parts;
  const std::string names = QueryValue(query, "bone");
  for (std::string_view rest = names; !rest.empty();) {
    const size_t end = std::min(rest.find(','), rest.size());
    if (end > 0) parts.bones.emplace_back(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
  }
  parts.skin = QueryYesOrNo(query, "skin");
  return parts;
}

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
  Json view{{"axis", task.view.axis},
            {"projection", task.view.projection},
            {"mm", number(task.view.at_mm)},
            {"width", number(task.view.width_mm)},
            {"height", number(task.view.height_mm)},
            {"pixel", number(task.view.pixel_mm)},
            {"slab", number(task.view.slab_mm)}};
  if (task.view.window) view["window"] = {task.view.window->first, task.view.window->second};
  for (int v = 0; task.view.oblique && v < 3; ++v) {
    const Eigen::Vector3d& x = (*task.view.oblique)[size_t(v)];
    view["oblique"].push_back({x.x(), x.y(), x.z()});
  }
  return {{"key_frames", task.key_frames},
          {"mode", NameOf(task.mode)},
          {"level", task.level},
          {"format", task.format},
          {"view", view}};
}

AnimationTask AnimationTaskOf(const std::string& model, const std::string& stored_request) {
  const Json stored = Json::parse(stored_request);
  AnimationTask task;
  task.model = model;
  task.key_frames = stored["key_frames"].get<std::string>();
  task.mode = DeformationModeFromName(stored["mode"].get<std::string>());
  task.level = stored["level"].get<int>();
  task.format = stored["format"].get<std::string>();
  const Json& view = stored["view"];
  const auto number = [&](const char* name) {
    return view[name].is_null() ? std::nullopt : std::optional(view[name].get<double>());
  };
  task.view.axis = view["axis"].get<std::string>(),
  task.view.projection = view["projection"].get<std::string>();
  task.view.at_mm = number("mm"), task.view.width_mm = number("width"),
  task.view.height_mm = number("height");
  task.view.pixel_mm = number("pixel"), task.view.slab_mm = number("slab");
  if (view.contains("window"))
    task.view.window = {view["window"][0].get<double>(), view["window"][1].get<double>()};
  if (view.contains("oblique")) {
    task.view.oblique.emplace();
    for (size_t v = 0; v < 3; ++v) {
      for (size_t a = 0; a < 3; ++a)
        (*task.view.oblique)[v][Eigen::Index(a)] = view["oblique"][v][a].get<double>();
    }
  }
  return task;
}

}  // namespace

FileAnswer GetSlice(Services& services, const std::string& model, const Query& query, const std::string& pose,
                    const Conditions& conditions) {
  const SliceFormatName& format = SliceFormatOf(query);
  PosedQuery posed = PosedQueryOf(services, model, query, kSliceParameters, pose);
  posed.abandoned = conditions.abandoned;
  const SliceView view = ViewOf(query);
  RequireBuilt(services, model);
  const PoseFacts facts = services.poser.FactsOf(posed);
  Hasher hasher;
  hasher.Add("slice").Add(facts.digest).Add(format.name);
  AddView(hasher, view);
  const Digest digest = hasher.Finish();
  const std::string suffix = "." + std::string(format.name);
  const FileAnswer answer = AnswerWith(digest, conditions, format.content_type, model + suffix, [&] {
    return services.results.Get(model + "." + digest.Hex() + suffix, [&](const std::filesystem::path& path) {
      services.poser.WriteSlice(posed, view, format.format, path);
    });
  });
  return Told(answer, facts);
}

FileAnswer GetSurface(Services& services, const std::string& model, const Query& query,
                      const std::string& pose, const Conditions& conditions) {
  const std::string format = QueryValue(query, "format", "glb");
  if (format != "glb" && format != "stl") throw InputError("'format' of a surface is glb or stl");
  PosedQuery posed = PosedQueryOf(services, model, query, {"bone", "skin", "format", "mode"}, pose);
  posed.abandoned = conditions.abandoned;
  const SurfaceParts parts = PartsOf(query);
  RequireBuilt(services, model);
  const PoseFacts facts = services.poser.FactsOf(posed);
  Hasher hasher;
  hasher.Add("surface").Add(facts.digest).Add(format).Add(int64_t(parts.skin));
  for (const std::string& bone : parts.bones) hasher.Add(bone);
  const Digest digest = hasher.Finish();
  const char* type = format == "glb" ? "model/gltf-binary" : "model/stl";
  const FileAnswer answer = AnswerWith(digest, conditions, type, model + "." + format, [&] {
    return services.results.GetBytes(model + "." + digest.Hex() + "." + format, [&] {
      return services.poser.Surface(posed, parts,
                                    format == "glb" ? SurfaceFormat::kGlb : SurfaceFormat::kStl);
    });
  });
  return Told(answer, facts);
}

Answer CreateAnimation(Services& services, const std::string& model, const Query& query,
                       const std::string& body, const std::string& idempotency_key) {
  RequireKnown(query, kSliceParameters);
  std::string scope = "POST /v1/models/" + model + "/animations?";
  for (const auto& [name, value] : query) scope += name + "=" + value + "&";
  const RequestKey key = KeyOf(scope, idempotency_key, body);
  if (auto answer = services.idempotency.Find(key)) return *answer;
  AnimationTask task;
  task.model = model;
  task.key_frames = body;
  task.mode = PosedQueryOf(services, model, query, kSliceParameters, "").mode;
  task.level = QueryInt(query, "level", 0, 0, 5);
  task.format = QueryValue(query, "format", "nii.gz");
  task.view = ViewOf(query);
  RequireBuilt(services, model);
  services.poser.CheckAnimation(task);
  const Answer answer = services.idempotency.Once(key, [&]() -> Answer {
    const JobRecord job = services.jobs.Submit({kAnimationKind, model, Dump(Stored(task))});
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
  const AnimationTask task = AnimationTaskOf(model, job.request);
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
  if (!services.results.Find(name)) services.poser.WriteAnimation(task, name, progress);
  return Dump(Json{{"content", "/v1/models/" + job.model + "/animations/" + job.id},
                   {"model", job.model},
                   {"frames", facts.frames},
                   {"format", task.format},
                   {"digest", facts.digest.Hex()}});
}

}  // namespace kvx
