// A slice is made while the client waits.
#include "api/handlers/slices.h"

#include "api/handlers/slice_query.h"
#include "core/errors.h"

namespace kvx {
namespace {

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

}  // namespace

FileAnswer GetSlice(Services& services, const std::string& model, const Query& query, const std::string& pose,
                    const Conditions& conditions) {
  const SliceFormatName& format = SliceFormatOf(query);
  PosedQuery posed = PosedQueryOf(services, model, query, kSliceParameters, pose);
  posed.abandoned = conditions.abandoned;
  const SliceView view = ViewOf(query);
  RequireProjectionOfSlab(view);
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

}  // namespace kvx
