// Both formats are lines of "key: value" or "key = value", ended by an empty line or by the line that names
// the data.
#include "pipeline/io/text_header.h"

#include <charconv>
#include <fstream>
#include <map>
#include <sstream>

#include "core/errors.h"
#include "core/lower_case.h"

namespace kvx {
namespace {

using HeaderFields = std::map<std::string, std::string>;  // keys in lower case

constexpr double kDeflateLimit = 1032;  // deflate never packs better than this
constexpr int kMostLines = 10000;
const char kBadHeader[] = "the volume's header is damaged; convert the original images again";

std::string Trimmed(const std::string& text) {
  const size_t first = text.find_first_not_of(" \t\r");
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

HeaderFields ReadFields(const std::filesystem::path& path, char separator, const std::string& last_key) {
  std::ifstream in(path, std::ios::binary);
  HeaderFields fields;
  std::string line;
  for (int n = 0; n < kMostLines && std::getline(in, line) && !Trimmed(line).empty(); ++n) {
    const size_t at = line.find(separator);
    if (line[0] == '#' || at == std::string::npos) continue;
    const std::string key = LowerCase(Trimmed(line.substr(0, at)));
    fields.emplace(key, Trimmed(line.substr(at + 1)));
    if (key == last_key) break;
  }
  return fields;
}

std::string ValueOf(const HeaderFields& fields, const std::string& key) {
  const auto found = fields.find(key);
  return found == fields.end() ? "" : found->second;
}

void RequireSizes(const std::string& dimension_text, const std::string& sizes_text) {
  std::istringstream sizes(sizes_text), dimension(dimension_text);
  long long count = 0, size = 0, seen = 0;
  if (!(dimension >> count) || count < 1 || count > 10) throw InputError(kBadHeader);
  for (; sizes >> size; ++seen) {
    if (size < 1) throw InputError("the volume's header gives a size that is not positive");
    if (size > 2147483647)
      throw InputError("the volume's header gives a size beyond all measure; it is damaged");
  }
  if (seen != count) throw InputError(kBadHeader);
}

std::string DataFileName(bool nrrd, const HeaderFields& fields) {
  return nrrd ? ValueOf(fields, fields.contains("data file") ? "data file" : "datafile")
              : ValueOf(fields, "elementdatafile");
}

std::filesystem::path DataFile(const std::filesystem::path& header, const std::string& data_file) {
  if (data_file.empty() || LowerCase(data_file) == "local") return {};
  const std::filesystem::path name = data_file;
  const bool list = data_file.starts_with("LIST") || data_file.find('%') != std::string::npos;
  if (list || name.has_parent_path() || name == "." || name == "..") {
    throw InputError(
        "the volume's header refers to data in another folder or in many files; save the volume as one file");
  }
  const std::filesystem::path data = header.parent_path() / name;
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(data, ignored)) {
    throw InputError(
        "the data file that the volume's header names does not lie beside it; give both files together");
  }
  return data;
}

// Of a NRRD's "key:=value".
int WholeNumber(const HeaderFields& fields, const std::string& key) {
  const std::string text = ValueOf(fields, key);
  if (!text.starts_with('=')) throw InputError(kBadHeader);
  int number = 0;
  const auto [end, error] = std::from_chars(text.data() + 1, text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || number < 0) throw InputError(kBadHeader);
  return number;
}

HeaderFields FieldsOf(bool nrrd, const std::filesystem::path& path) {
  return ReadFields(path, nrrd ? ':' : '=', nrrd ? "" : "elementdatafile");
}

std::string KeyOfSegment(size_t index) { return "segment" + std::to_string(index) + "_"; }

bool NamesSegment(const HeaderFields& fields, size_t index) {
  return fields.contains(KeyOfSegment(index) + "id") || fields.contains(KeyOfSegment(index) + "labelvalue");
}

// Before its version 4.11, 3D Slicer gave each segment a layer of its own, 1 inside, and did not say so.
Segment SegmentAt(const HeaderFields& fields, size_t index) {
  const std::string key = KeyOfSegment(index);
  if (!fields.contains(key + "labelvalue")) return {int(index), 1};
  return {WholeNumber(fields, key + "layer"), WholeNumber(fields, key + "labelvalue")};
}

}  // namespace

std::filesystem::path DetachedDataOf(FileFormat format, const std::filesystem::path& path) {
  const bool nrrd = format == FileFormat::kNrrd;
  return DataFile(path, DataFileName(nrrd, FieldsOf(nrrd, path)));
}

double RequireSaneTextHeader(FileFormat format, const std::filesystem::path& path) {
  const bool nrrd = format == FileFormat::kNrrd;
  const HeaderFields fields = FieldsOf(nrrd, path);
  RequireSizes(ValueOf(fields, nrrd ? "dimension" : "ndims"), ValueOf(fields, nrrd ? "sizes" : "dimsize"));
  const std::filesystem::path data = DataFile(path, DataFileName(nrrd, fields));
  const auto on_disk = double(std::filesystem::file_size(data.empty() ? path : data));
  if (nrrd) {
    const std::string encoding = LowerCase(ValueOf(fields, "encoding"));
    if (encoding == "raw") return on_disk;
    if (encoding.starts_with("bz"))
      throw InputError("the volume is packed by bzip2, which is not read here; save it raw or with gzip");
    return on_disk * (encoding.starts_with("gz") ? kDeflateLimit : 8);  // text: at least a character a voxel
  }
  if (LowerCase(ValueOf(fields, "compresseddata")) == "true") return on_disk * kDeflateLimit;
  return on_disk * (LowerCase(ValueOf(fields, "binarydata")) == "false" ? 8 : 1);
}

bool IsLeftAnteriorSuperior(const std::filesystem::path& nrrd) {
  const std::string space = LowerCase(ValueOf(ReadFields(nrrd, ':', ""), "space"));
  return space == "las" || space == "left-anterior-superior" || space == "last" ||
         space == "left-anterior-superior-time";
}

bool NamesSegments(const std::filesystem::path& nrrd) { return NamesSegment(FieldsOf(true, nrrd), 0); }

std::vector<Segment> SegmentsOf(const std::filesystem::path& nrrd) {
  const HeaderFields fields = FieldsOf(true, nrrd);
  std::vector<Segment> out;
  while (NamesSegment(fields, out.size())) out.push_back(SegmentAt(fields, out.size()));
  return out;
}

}  // namespace kvx
