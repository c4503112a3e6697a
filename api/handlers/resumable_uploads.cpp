// What a plain upload says in its query, a resumable one says in its metadata.
#include "api/handlers/resumable_uploads.h"

#include <openssl/evp.h>

#include <nlohmann/json.hpp>

#include "api/errors.h"
#include "core/text/base64.h"
#include "core/text/hex_digest.h"
#include "core/text/parse_number.h"

namespace kvx {
namespace {

constexpr size_t kLongestMetadata = 4096;
constexpr int kMostOpenOfSubject = 256;
constexpr int64_t kKeepEveryBytes = int64_t(16) << 20;

std::string Decoded(const std::string& text, const char* what) {
  const std::optional<std::string> bytes = FromBase64(text);
  if (!bytes) throw InputError(std::string(what) + " is not base64");
  return *bytes;
}

std::vector<std::string> Split(const std::string& text, char at) {
  std::vector<std::string> parts;
  for (size_t begin = 0; begin <= text.size();) {
    const size_t end = std::min(text.find(at, begin), text.size());
    parts.push_back(text.substr(begin, end - begin));
    begin = end + 1;
  }
  return parts;
}

using Metadata = std::map<std::string, std::string>;

// "key base64,key base64,key"; what we do not know is the client's own and is left alone.
Metadata ParseMetadata(const std::string& text) {
  if (text.size() > kLongestMetadata) throw InputError("Upload-Metadata is longer than 4096 bytes");
  Metadata metadata;
  for (const std::string& item : Split(text, ',')) {
    const size_t first = item.find_first_not_of(" \t");  // whoever joins headers puts a blank behind a comma
    if (first == item.npos) continue;
    const std::vector<std::string> words = Split(item.substr(first), ' ');
    const std::string value = words.size() > 1 ? Decoded(words[1], "a value in Upload-Metadata") : "";
    if (!metadata.emplace(words[0], value).second)
      throw InputError("Upload-Metadata has a key twice; leave one of them");
  }
  return metadata;
}

std::string ValueOf(const Metadata& metadata, const std::string& key) {
  const auto found = metadata.find(key);
  return found == metadata.end() ? "" : found->second;
}

int64_t ParseCount(const std::string& text, const char* header) {
  const auto count = ParseAs<int64_t>(text);
  if (!count || *count < 0) throw InputError(std::string(header) + " is a count of bytes");
  return *count;
}

int64_t LengthOf(const Services& services, const std::string& header) {
  if (header.empty()) throw InputError("Upload-Length is missing; uploads of unknown length are not taken");
  const int64_t bytes = ParseCount(header, "Upload-Length");
  if (bytes == 0) throw InputError("the upload is empty; send the file itself");
  if (bytes > services.upload_quota_bytes)
    throw QuotaExceeded("the upload is larger than the service accepts");
  return bytes;
}

// The query of the plain upload. It has a kind for strokes alone.
Json ParametersFrom(const Metadata& metadata, bool bones) {
  Json parameters = Json::object();
  const auto take = [&](const char* key) {
    const std::string value = ValueOf(metadata, key);
    if (!value.empty()) parameters[key] = value;
  };
  take("filename");
  take(bones ? "template" : "name");
  if (bones) take("previous");
  if (ValueOf(metadata, "kind") == "seeds") take("kind");
  return parameters;
}

// What the metadata say of an upload, checked as far as that goes without the service's records.
ResumableUpload UploadOf(const std::string& text) {
  const Metadata metadata = ParseMetadata(text);
  ResumableUpload upload;
  upload.metadata = text;
  upload.subject = ValueOf(metadata, "subject");
  if (upload.subject.empty()) throw InputError("Upload-Metadata lacks 'subject', the id of a subject");
  const std::string kind = ValueOf(metadata, "kind");
  const bool bones = kind == "bones" || kind == "seeds";
  if (!bones && !kind.empty() && kind != "scan")
    throw InputError("'kind' in Upload-Metadata is scan, bones or seeds (strokes)");
  upload.kind = bones ? "bones" : "scan";
  const std::string sha256 = ValueOf(metadata, "sha256");
  if (!sha256.empty()) {
    if (!IsHexDigest(sha256))
      throw InputError("'sha256' in Upload-Metadata is 64 hexadecimal digits, lower case");
    upload.sha256 = sha256;
  }
  upload.parameters = Dump(ParametersFrom(metadata, bones));
  return upload;
}

Query QueryFrom(const std::string& parameters) {
  Query query;
  const Json json = Json::parse(parameters);
  for (const auto& item : json.items()) query.emplace(item.key(), item.value().get<std::string>());
  return query;
}

Upload OpenUpload(Services& services, const ResumableUpload& upload, std::optional<IncomingBlob> received) {
  const Query query = QueryFrom(upload.parameters);
  if (upload.kind == "bones")
    return Upload::OfBones(services, upload.subject, query, "", std::move(received));
  return Upload::OfScan(services, upload.subject, query, "", std::move(received));
}

// It leaves nothing; nothing is left of one whose subject was removed.
void DropRefused(Services& services, const std::string& id) {
  try {
    services.resumable.Remove(id);
  } catch (const NotFound&) {
  }
}

}  // namespace

ResumableUpload RequireResumableUpload(Services& services, const std::string& id) {
  const ResumableUpload upload = services.resumable.Require(id);
  try {
    services.catalogue.RequireSubject(upload.subject);
  } catch (const NotFound&) {  // of another project
    throw NotFound("there is no such upload");
  }
  return upload;
}

ResumableUpload CreateResumableUpload(Services& services, const std::string& length,
                                      const std::string& metadata) {
  const int64_t bytes = LengthOf(services, length);
  ResumableUpload upload = UploadOf(metadata);
  upload.length = bytes;
  OpenUpload(services, upload, std::nullopt).RequireFree();  // all that can be refused before the first byte
  if (services.resumable.CountOpen(upload.subject) >= kMostOpenOfSubject) {
    throw LimitReached(
        "the subject has 256 unfinished uploads; finish or delete some, or wait until they expire");
  }
  return services.resumable.Create(upload);
}

// One digest of one request's bytes.
struct ResumablePart::Checksum {
  std::unique_ptr<EVP_MD_CTX, decltype(&EVP_MD_CTX_free)> context{EVP_MD_CTX_new(), EVP_MD_CTX_free};
  std::string expected;

  explicit Checksum(const std::string& header) {
    const std::vector<std::string> words = Split(header, ' ');
    const bool known = words[0] == "sha1" || words[0] == "sha256" || words[0] == "md5";
    if (words.size() != 2 || !known)
      throw InputError("Upload-Checksum is sha1, sha256 or md5, a blank, and base64");
    expected = Decoded(words[1], "the digest in Upload-Checksum");
    if (EVP_DigestInit_ex(context.get(), EVP_get_digestbyname(words[0].c_str()), nullptr) != 1) {
      throw InputError("this kind of Upload-Checksum is not available here; use sha256");
    }
  }
  void Add(std::span<const char> bytes) { EVP_DigestUpdate(context.get(), bytes.data(), bytes.size()); }
  bool Matches() {
    unsigned char digest[EVP_MAX_MD_SIZE];
    unsigned size = 0;
    EVP_DigestFinal_ex(context.get(), digest, &size);
    return expected == std::string(reinterpret_cast<char*>(digest), size);
  }
};

ResumablePart::ResumablePart(Services& services, const std::string& id, const std::string& offset,
                             const std::string& checksum)
    : services_(services), writer_(services.resumable.Continue(RequireResumableUpload(services, id).id)) {
  if (ParseCount(offset, "Upload-Offset") != writer_->upload().received) {
    throw Conflict("Upload-Offset is not where the upload stands; ask by HEAD and go on from there");
  }
  if (!checksum.empty()) checksum_ = std::make_unique<Checksum>(checksum);
  kept_ = writer_->offset();
}

ResumablePart::~ResumablePart() = default;

void ResumablePart::Write(std::span<const char> bytes) {
  writer_->Write(bytes);
  room_.Wrote(bytes.size());
  if (checksum_) return checksum_->Add(bytes);
  if (writer_->offset() - kept_ < kKeepEveryBytes) return;
  writer_->Keep();
  kept_ = writer_->offset();
}

void ResumablePart::BrokeOff() {
  if (!checksum_) writer_->Keep();
}

ResumableUpload ResumablePart::Finish() {
  if (writer_->upload().location) return writer_->upload();  // an empty part after the end
  if (checksum_ && !checksum_->Matches())
    throw ChecksumMismatch("the bytes do not match Upload-Checksum; send them again");
  writer_->Keep();
  if (!writer_->Complete()) return writer_->upload();
  try {
    StoreWhole();
    return writer_->upload();
  } catch (const Unavailable&) {
    throw;  // may pass: the client goes on where it was
  } catch (const Cancelled&) {
    throw;  // it has gone, and may come back
  } catch (const Error&) {
    const std::string id = writer_->upload().id;
    writer_.reset();
    DropRefused(services_, id);
    throw;
  }
}

void ResumablePart::StoreWhole() {
  services_.catalogue.RequireSubject(writer_->upload().subject);  // removed, its bytes are gone, too
  const std::string filename =
      QueryValue(QueryFrom(writer_->upload().parameters), "filename", kBonesFilename);
  IncomingBlob blob = services_.blobs.Adopt(writer_->path(), RequireUploadFormat(filename).suffix);
  if (writer_->upload().sha256 && *writer_->upload().sha256 != blob.digest().Hex()) {
    throw InputError("the whole file does not match the sha256 announced; send it again");
  }
  Upload upload = OpenUpload(services_, writer_->upload(), std::move(blob));
  upload.Finish([this](const Answer& made) { writer_->Finish(made.location); });
  std::error_code ignored;
  std::filesystem::remove(writer_->path(), ignored);
}

std::string GetResumableUpload(Services& services, const std::string& id) {
  const ResumableUpload upload = RequireResumableUpload(services, id);
  Json json;
  json["id"] = upload.id;
  json["subject"] = upload.subject;
  json["kind"] = upload.kind;
  json["state"] = upload.location ? "finished" : "receiving";
  json["offset"] = upload.received;
  json["length"] = upload.length;
  json["location"] = upload.location ? Json(*upload.location) : Json();
  json["expires"] = IsoTime(upload.expires_ms);
  return Dump(json);
}

}  // namespace kvx
