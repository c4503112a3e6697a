// A surface is made while the client waits.
#include "api/handlers/surfaces.h"

#include "core/errors.h"
#include "core/text/comma_list.h"

namespace kvx {
namespace {

SurfaceParts PartsOf(const Query& query) {
  SurfaceParts parts;
  const std::string names = QueryValue(query, "bone");
  AddNamesOf(names, parts.bones);
  if (!names.empty() && parts.bones.empty())
    throw InputError("'bone' holds no name; give names of bones with commas between them, or leave it out");
  if (query.contains("skin")) parts.skin = QueryYesOrNo(query, "skin");
  return parts;
}

}  // namespace

FileAnswer GetSurface(Services& services, const std::string& model, const Query& query,
                      const std::string& pose, const Conditions& conditions) {
  const std::string format = FormatAmong(query, {"glb", "stl"}, "a surface");
  PosedQuery posed = PosedQueryOf(services, model, query, {"bone", "skin", "format", "mode"}, pose);
  const SurfaceParts parts = PartsOf(query);
  RequireBuilt(services, model);
  const PoseFacts facts = services.poser.FactsOf(posed);
  Hasher hasher;
  hasher.Add("surface of the labels' volume")
      .Add(facts.digest)
      .Add(format)
      .Add(int64_t(parts.skin.has_value()))
      .Add(int64_t(parts.skin.value_or(false)));
  for (const std::string& bone : parts.bones) hasher.Add(bone);
  const Digest digest = hasher.Finish();
  const char* type = format == "glb" ? "model/gltf-binary" : "model/stl";
  const FileAnswer answer = AnswerWith(digest, conditions, type, PosedFileName(model, digest, format), [&] {
    const auto make = [&] {
      return services.poser.Surface(posed, parts,
                                    format == "glb" ? SurfaceFormat::kGlb : SurfaceFormat::kStl);
    };
    return services.results.GetBytes(model + "." + digest.Hex() + "." + format, make, posed.asker);
  });
  return Told(answer, facts);
}

}  // namespace kvx
