// Both formats are lines of "key: value" or "key = value", ended by an empty line or by the line that names
// the data.
#include "pipeline/io/text_header.h"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <optional>
#include <set>
#include <sstream>

#include "core/errors.h"
#include "core/text/extension.h"
#include "core/text/lower_case.h"
#include "core/text/parse_number.h"

namespace kvx {
namespace {

constexpr double kDeflateLimit = 1032;  // deflate never packs better than this
constexpr int64_t kMostLines = 10000, kMostBytes = int64_t(16) << 20, kMostSkipped = int64_t(1) << 40;
const char kBadHeader[] = "the volume's header is damaged; convert the original images again";
const char kElsewhere[] =
    "the volume's header refers to data in another folder or in many files; save the volume as one file";

std::string Trimmed(const std::string& text) {
  const size_t first = text.find_first_not_of(" \t\r");
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(" \t\r") - first + 1);
}

// The next line without its end; false where the file has none.
bool NextLine(std::istream& in, TextHeader& header, std::string& line) {
  if (!std::getline(in, line)) return false;
  header.lines += 1, header.bytes += int64_t(line.size()) + (in.eof() ? 0 : 1);
  if (!line.empty() && line.back() == '\r') line.pop_back();
  if (header.lines > kMostLines || header.bytes > kMostBytes) throw InputError(kBadHeader);
  return true;
}

void AddOnce(const std::string& key, const std::string& value, std::map<std::string, std::string>& to) {
  const auto [field, is_new] = to.emplace(LowerCase(Trimmed(key)), Trimmed(value));
  if (!is_new && field->first != "comment" && field->second != Trimmed(value)) throw InputError(kBadHeader);
}

// NRRD: the magic, then "key: value" and "key:=value" up to an empty line, or to the end of a header whose
// data lies elsewhere.
void ReadNrrd(std::istream& in, TextHeader& header) {
  std::string line;
  if (!NextLine(in, header, line) || !line.starts_with("NRRD000")) throw InputError(kBadHeader);
  bool ended = false;
  while (!ended && NextLine(in, header, line)) {
    ended = line.empty();
    const size_t at = line.find(':');
    if (line.starts_with('#') || at == std::string::npos) continue;
    const bool note = line.substr(at + 1).starts_with('=');
    if (note)
      header.notes.emplace(LowerCase(Trimmed(line.substr(0, at))), Trimmed(line.substr(at + 2)));
    else
      AddOnce(line.substr(0, at), line.substr(at + 1), header.fields);
  }
  header.attached = header.Value("data file").empty() && header.Value("datafile").empty();
  if (header.attached && !ended) throw InputError(kBadHeader);
}

// MetaImage: "Key = value" up to the data file's.
void ReadMeta(std::istream& in, TextHeader& header) {
  std::string line;
  while (!header.fields.contains("elementdatafile")) {
    if (!NextLine(in, header, line)) throw InputError(kBadHeader);
    const size_t at = line.find_first_of("=:");
    if (at != std::string::npos) AddOnce(line.substr(0, at), line.substr(at + 1), header.fields);
  }
  header.attached = LowerCase(header.Value("elementdatafile")) == "local";
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

std::filesystem::path BesideHeader(const std::filesystem::path& header, const std::string& data_file) {
  const std::filesystem::path name = data_file;
  if ((!HasExtension(header, ".nhdr") && !HasExtension(header, ".mhd")) || !IsNameable(data_file) ||
      name.has_parent_path() || name.empty() || name == "." || name == "..") {
    throw InputError(kElsewhere);
  }
  const std::filesystem::path data = header.parent_path() / name;
  std::error_code ignored;
  if (!std::filesystem::is_regular_file(data, ignored)) {
    throw InputError(
        "the data file that the volume's header names does not lie beside it; give both files together");
  }
  return data;
}

std::string DataFileName(const TextHeader& header) {
  if (header.format == FileFormat::kMeta) return header.Value("elementdatafile");
  return header.Value(header.fields.contains("data file") ? "data file" : "datafile");
}

int WholeNumber(const std::string& text) {
  int number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  if (error != std::errc() || end != text.data() + text.size() || number < 0) throw InputError(kBadHeader);
  return number;
}

// Of one of a field's names, at least -1; 0 where the header does not say.
int64_t SkipOf(const TextHeader& header, std::initializer_list<const char*> names) {
  const std::string text = header.FirstOf(names);
  if (text.empty()) return 0;
  int64_t number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  const bool whole = error == std::errc() && end == text.data() + text.size();
  if (!whole || number < -1 || number > kMostSkipped) throw InputError(kBadHeader);
  return number;
}

bool IsYes(const std::string& text) {
  return text.starts_with('t') || text.starts_with('T') || text.starts_with('1');
}

// Of a NRRD in quotes.
std::vector<std::string> UnitsOf(const TextHeader& header) {
  if (header.format == FileFormat::kMeta) return {header.Value("distanceunits")};
  const std::string text = header.FirstOf({"space units", "units"});
  std::vector<std::string> units;
  for (size_t begin = text.find('"'); begin != text.npos; begin = text.find('"', begin)) {
    const size_t end = std::min(text.find('"', begin + 1), text.size());
    units.push_back(text.substr(begin + 1, end - begin - 1));
    begin = std::min(end + 1, text.size());
  }
  return units;
}

// Nothing where it is no length but says that it does not know, or a time.
std::optional<double> LengthInMm(const std::string& unit) {
  static const std::map<std::string, double> kLengths{{"mm", 1},
                                                      {"millimeter", 1},
                                                      {"millimeters", 1},
                                                      {"millimetre", 1},
                                                      {"millimetres", 1},
                                                      {"um", 1e-3},
                                                      {"\u00b5m", 1e-3},
                                                      {"\u03bcm", 1e-3},
                                                      {"micron", 1e-3},
                                                      {"microns", 1e-3},
                                                      {"micrometer", 1e-3},
                                                      {"micrometers", 1e-3},
                                                      {"nm", 1e-6},
                                                      {"cm", 10},
                                                      {"centimeter", 10},
                                                      {"centimeters", 10},
                                                      {"m", 1000},
                                                      {"meter", 1000},
                                                      {"meters", 1000},
                                                      {"micrometre", 1e-3},
                                                      {"metre", 1000},
                                                      {"micrometres", 1e-3},
                                                      {"metres", 1000}};
  static const std::set<std::string> kNone{"", "?", "??", "???", "none", "unknown", "s", "ms", "sec"};
  const std::string name = LowerCase(Trimmed(unit));
  if (kNone.contains(name)) return std::nullopt;
  const auto found = kLengths.find(name);
  if (found == kLengths.end()) {
    throw InputError(
        "the volume's header gives its lengths in a unit that is not known here; save it in millimetres");
  }
  return found->second;
}

double NumberOf(const TextHeader& header, const std::string& key, double otherwise) {
  const std::string text = header.Value(key);
  if (text.empty()) return otherwise;
  const auto number = ParseFinite(text);
  if (!number) throw InputError(kBadHeader);
  return *number;
}

// What of the file may be voxels as they are.
double RawBytes(const TextHeader& header) {
  const VoxelStart start = VoxelStartOf(header);
  const int64_t in_front = header.format == FileFormat::kMeta || !header.attached
                               ? start.bytes
                               : header.bytes + std::max<int64_t>(0, start.bytes);
  const auto on_disk = double(std::filesystem::file_size(header.voxels));
  return std::max(1.0, on_disk - double(std::max<int64_t>(0, in_front)));
}

std::string NoteOf(const TextHeader& nrrd, const std::string& key) {
  const auto found = nrrd.notes.find(key);
  return found == nrrd.notes.end() ? "" : found->second;
}

std::string KeyOfSegment(size_t index) { return "segment" + std::to_string(index) + "_"; }

bool NamesSegment(const TextHeader& nrrd, size_t index) {
  return nrrd.notes.contains(KeyOfSegment(index) + "id") ||
         nrrd.notes.contains(KeyOfSegment(index) + "labelvalue");
}

// Before its version 4.11, 3D Slicer gave each segment a layer of its own, 1 inside, and did not say so.
Segment SegmentAt(const TextHeader& nrrd, size_t index) {
  const std::string key = KeyOfSegment(index);
  const auto note = nrrd.notes.find(key + "name");
  const std::string name = note == nrrd.notes.end() ? "" : note->second;
  if (!nrrd.notes.contains(key + "labelvalue")) return {int(index), 1, name};
  return {WholeNumber(NoteOf(nrrd, key + "layer")), WholeNumber(NoteOf(nrrd, key + "labelvalue")), name};
}

}  // namespace

std::string TextHeader::Value(const std::string& key) const {
  const auto found = fields.find(key);
  return found == fields.end() ? "" : found->second;
}

std::string TextHeader::FirstOf(std::initializer_list<const char*> names) const {
  for (const char* name : names)
    if (!Value(name).empty()) return Value(name);
  return "";
}

bool IsNameable(const std::string& data_file) {
  const bool list = data_file.starts_with("LIST") || data_file.find('%') != std::string::npos;
  return !list && data_file.find('\n') == std::string::npos && Trimmed(data_file) == data_file;
}

TextHeader ReadTextHeader(FileFormat format, const std::filesystem::path& path) {
  TextHeader header{.format = format, .voxels = path};
  std::ifstream in(path, std::ios::binary);
  const bool nrrd = format == FileFormat::kNrrd;
  nrrd ? ReadNrrd(in, header) : ReadMeta(in, header);
  RequireSizes(header.Value(nrrd ? "dimension" : "ndims"), header.Value(nrrd ? "sizes" : "dimsize"));
  if (!header.attached) header.voxels = BesideHeader(path, DataFileName(header));
  return header;
}

VoxelStart VoxelStartOf(const TextHeader& header) {
  if (header.format == FileFormat::kNrrd) {
    const int64_t lines = SkipOf(header, {"line skip", "lineskip"});
    return {std::max<int64_t>(0, lines) + (header.attached ? header.lines : 0),
            SkipOf(header, {"byte skip", "byteskip"})};
  }
  const int64_t bytes = SkipOf(header, {"headersize"});
  return {0, header.attached && bytes == 0 ? header.bytes : bytes};
}

bool IsPackedMeta(const TextHeader& meta) { return IsYes(meta.Value("compresseddata")); }

bool IsTextMeta(const TextHeader& meta) {
  const std::string binary = meta.Value("binarydata");
  return !binary.empty() && !IsYes(binary);
}

int64_t PackedBytesOf(const TextHeader& meta) {
  const int64_t start = VoxelStartOf(meta).bytes, said = SkipOf(meta, {"compresseddatasize"});
  if (start < 0 || said < 0) throw InputError(kBadHeader);
  return said > 0 ? said : int64_t(std::filesystem::file_size(meta.voxels)) - start;
}

double MostVoxelBytes(const TextHeader& header) {
  const auto on_disk = double(std::filesystem::file_size(header.voxels));
  if (header.format == FileFormat::kNrrd) {
    const std::string encoding = LowerCase(header.Value("encoding"));
    if (encoding == "raw") return RawBytes(header);
    if (encoding.starts_with("bz"))
      throw InputError("the volume is packed by bzip2, which is not read here; save it raw or with gzip");
    return on_disk * (encoding.starts_with("gz") ? kDeflateLimit : 8);  // text: at least a character a voxel
  }
  if (IsPackedMeta(header)) return on_disk * kDeflateLimit;
  return IsTextMeta(header) ? on_disk * 8 : RawBytes(header);
}

double MmPerUnit(const TextHeader& header) {
  std::optional<double> mm;
  for (const std::string& unit : UnitsOf(header)) {
    const std::optional<double> of_it = LengthInMm(unit);
    if (mm && of_it && *mm != *of_it)
      throw InputError("the volume's header gives its lengths in several units; save it in millimetres");
    if (of_it) mm = of_it;
  }
  return mm.value_or(1.0);
}

Rescale RescaleOf(const TextHeader& header) {
  if (header.format != FileFormat::kMeta) return {};
  const Rescale rescale{NumberOf(header, "elementtointensityfunctionslope", 1),
                        NumberOf(header, "elementtointensityfunctionoffset", 0)};
  if (rescale.slope == 0) throw InputError(kBadHeader);
  return rescale;
}

std::string SpaceOf(const TextHeader& nrrd) {
  std::string space = LowerCase(nrrd.Value("space"));
  std::erase_if(space, [](char c) { return c == '-' || c == ' '; });
  return space;
}

bool NamesSegments(const TextHeader& nrrd) { return NamesSegment(nrrd, 0); }

std::vector<Segment> SegmentsOf(const TextHeader& nrrd) {
  std::vector<Segment> out;
  while (NamesSegment(nrrd, out.size())) out.push_back(SegmentAt(nrrd, out.size()));
  return out;
}

}  // namespace kvx
