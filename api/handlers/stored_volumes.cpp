// A converted file is readable as long as it is open, and its folder goes at once.
#include "api/handlers/stored_volumes.h"

namespace kvx {

FileAnswer AnswerWithStored(Services& services, const StoredFile& file, const StoredForm& form,
                            const Conditions& conditions, const Convert& convert) {
  const std::string suffix = "." + form.format;
  const bool as_uploaded = file.suffix == suffix;
  Hasher hasher;
  hasher.Add("stored volume").Add(file.sha256).Add(form.format);
  if (!as_uploaded) hasher.Add(services.builder.ConversionVersion());
  const char* type = form.format == "nii.gz" ? "application/gzip" : "application/octet-stream";
  return AnswerWith(hasher.Finish(), conditions, type, form.id + suffix, [&] {
    const std::filesystem::path content = services.blobs.PathOf(file.content);
    if (as_uploaded) return std::make_shared<const CachedFile>(content);
    const std::shared_ptr<void> turn = services.reading_turn();
    const IncomingFolder folder = services.blobs.ReceiveFolder();
    const std::filesystem::path converted = folder.path() / ("volume" + suffix);
    convert({"volume" + file.suffix, content}, converted);
    return std::make_shared<const CachedFile>(converted);
  });
}

}  // namespace kvx
