// Volumes in every format and content coding, each a kept file of its own; coarse fields for a viewer.
#include "api/handlers/posed_volumes.h"

#include "core/errors.h"

namespace kvx {
namespace {

constexpr int64_t kDicomEdition = 4;  // raised when series say other things of the same voxels
constexpr int kUsualFieldLevel = 2;   // a quarter of the resolution

struct FormatName {
  std::string_view name, extension;
  VolumeFormat format;
  const char* content_type;
  bool coded;  // worth a content coding
};
constexpr FormatName kBonesAsDicom{"dicom", "dcm", VolumeFormat::kDicom, "application/dicom", false};
constexpr FormatName kFormats[] = {{"nii.gz", "nii.gz", VolumeFormat::kNiftiGz, "application/gzip", false},
                                   {"nii", "nii", VolumeFormat::kNifti, "application/octet-stream", true},
                                   {"nrrd", "nrrd", VolumeFormat::kNrrd, "application/octet-stream", false},
                                   {"mha", "mha", VolumeFormat::kMha, "application/octet-stream", false},
                                   {"raw", "raw", VolumeFormat::kRaw, "application/octet-stream", true},
                                   {"dicom", "zip", VolumeFormat::kDicom, "application/zip", false}};

const FormatName& FormatOf(const Query& query, bool labels) {
  const std::string wanted = QueryValue(query, "format", "nii.gz");
  if (labels && wanted == kBonesAsDicom.name) return kBonesAsDicom;
  for (const FormatName& format : kFormats) {
    if (format.name == wanted) return format;
  }
  throw InputError("'format' is nii.gz, nii, nrrd, mha, raw or dicom");
}

// Throws InputError for what only a DICOM series can have, and for what it cannot.
DicomNames DicomNamesOf(Services& services, const FormatName& format, const Query& query,
                        const PosedQuery& posed) {
  const std::string modality = QueryValue(query, "modality");
  if (format.format != VolumeFormat::kDicom) {
    if (!modality.empty()) throw InputError("'modality' is for format=dicom");
    return {};
  }
  if (!modality.empty() && modality != "MR" && modality != "CT") throw InputError("'modality' is MR or CT");
  return {services.catalogue.RequireModel(posed.model).subject, modality};
}

Digest PlainDigest(const PoseFacts& posed, const FormatName& format, const DicomNames& names) {
  Hasher hasher;
  hasher.Add(posed.digest).Add(format.name).Add(names.modality);
  if (format.format == VolumeFormat::kDicom) hasher.Add(kDicomEdition).Add(posed.world);
  return hasher.Finish();
}

std::shared_ptr<const CachedFile> PlainVolume(Services& services, const PosedQuery& posed,
                                              const FormatName& format, const DicomNames& names,
                                              const Digest& digest) {
  const std::string name = posed.model + "." + digest.Hex() + "." + std::string(format.extension);
  if (format.format == VolumeFormat::kRaw)
    return services.results.GetBytes(
        name, [&] { return services.poser.RawVolume(posed); }, posed.asker);
  const auto write = [&](const std::filesystem::path& path) {
    if (format.format == VolumeFormat::kDicom) return services.poser.WriteDicom(posed, names, path);
    services.poser.WriteVolume(posed, format.format, path);
  };
  return services.results.Get(name, write, posed.asker);
}

}  // namespace

FileAnswer GetVolume(Services& services, const std::string& model, const Query& query,
                     const std::string& pose, const Conditions& conditions) {
  const bool labels = QueryYesOrNo(query, "label");
  const FormatName& format = FormatOf(query, labels);
  PosedQuery posed =
      PosedQueryOf(services, model, query, {"format", "mode", "level", "label", "modality"}, pose);
  posed.labels = labels;
  RequireBuilt(services, model);
  const DicomNames names = DicomNamesOf(services, format, query, posed);
  const Encoding encoding = format.coded ? BestEncoding(conditions.accept_encoding) : Encoding::kIdentity;
  const PoseFacts facts = services.poser.FactsOf(posed);
  const Digest plain = PlainDigest(facts, format, names);
  const bool coded = encoding != Encoding::kIdentity;
  const Digest digest = coded ? Hasher().Add(plain).Add(NameOf(encoding)).Finish() : plain;
  const size_t header_bytes = format.format == VolumeFormat::kRaw ? kRawHeaderBytes : 0;
  FileAnswer answer =
      AnswerWith(digest, conditions, format.content_type, PosedFileName(model, plain, format.extension), [&] {
        if (!coded) return PlainVolume(services, posed, format, names, plain);
        const auto write = [&](const std::filesystem::path& path) {
          WriteEncoded(*PlainVolume(services, posed, format, names, plain), header_bytes, encoding, path);
        };
        return services.results.Get(model + "." + digest.Hex() + "." + NameOf(encoding), write, posed.asker);
      });
  if (format.coded) answer.headers.push_back({"Vary", "Accept-Encoding"});
  if (answer.not_modified) return Told(answer, facts);
  if (coded) answer.headers.push_back({"Content-Encoding", NameOf(encoding)});
  if (header_bytes) TellGeometry(answer);
  return Told(answer, facts);
}

FileAnswer GetField(Services& services, const std::string& model, const Query& query, const std::string& pose,
                    const Conditions& conditions) {
  PosedQuery posed = PosedQueryOf(services, model, query, {"mode", "level"}, pose);
  posed.level = QueryLevel(query, kUsualFieldLevel);
  RequireBuilt(services, model);
  const PoseFacts facts = services.poser.FactsOf(posed);
  const Digest digest = Hasher().Add("field").Add(facts.digest).Finish();
  FileAnswer answer = AnswerWith(
      digest, conditions, "application/octet-stream", PosedFileName(model, digest, "field.raw"), [&] {
        return services.results.GetBytes(
            model + "." + digest.Hex() + ".field", [&] { return services.poser.Field(posed); }, posed.asker);
      });
  if (!answer.not_modified) TellGeometry(answer);
  return Told(answer, facts);
}

}  // namespace kvx
