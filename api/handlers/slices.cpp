// A slice is made while the client waits.
#include "api/handlers/slices.h"

#include <fstream>
#include <iterator>

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

// A kept file says where it lies, as raw volumes do: a picture has no place for that.
void PutBefore(const std::string& header, const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  const std::string content{std::istreambuf_iterator<char>(in), {}};
  in.close();
  std::ofstream out(path, std::ios::binary | std::ios::trunc);
  out << header << content;
  if (!out.flush()) throw Unavailable("the slice cannot be kept; is the service's disk full?");
}

}  // namespace

FileAnswer GetSlice(Services& services, const std::string& model, const Query& query, const std::string& pose,
                    const Conditions& conditions) {
  const SliceFormatName& format = SliceFormatOf(query);
  PosedQuery posed = PosedQueryOf(services, model, query, kSliceParameters, pose);
  const SliceRequest view = ViewOf(query);
  view.Validate();
  RequireBuilt(services, model);
  const PoseFacts facts = services.poser.FactsOf(posed);
  Hasher hasher;
  hasher.Add("slice with header").Add(facts.digest).Add(format.name);
  AddView(hasher, view);
  const Digest digest = hasher.Finish();
  const std::string suffix = "." + std::string(format.name);
  FileAnswer answer =
      AnswerWith(digest, conditions, format.content_type, PosedFileName(model, digest, format.name), [&] {
        const auto write = [&](const std::filesystem::path& path) {
          PutBefore(services.poser.WriteSlice(posed, view, format.format, path), path);
        };
        return services.results.Get(model + "." + digest.Hex() + suffix, write, posed.asker);
      });
  if (!answer.not_modified) TellGeometry(answer);
  return Told(std::move(answer), facts);
}

}  // namespace kvx
