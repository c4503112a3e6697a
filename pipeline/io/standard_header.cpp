// Fields that only describe (comments, names) are left out, and those that ITK does not heed: units and how
// voxels are rescaled (MmPerUnit, RescaleOf).
#include "pipeline/io/standard_header.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <utility>

#include "core/errors.h"

namespace kvx {
namespace {

const char kBadValue[] =
    "the volume's header has a value that makes no sense; convert the original images again";

constexpr size_t kLongestValue = 1000;  // so that the whole stays short, as a reader with limits may write it

// What numbers, vectors and the formats' words are made of.
std::string Plain(const std::string& value) {
  const auto plain = [](unsigned char c) {
    return c < 128 &&
           (std::isalnum(c) || std::string_view(" \t+-._,()?").find(char(c)) != std::string_view::npos);
  };
  if (value.size() > kLongestValue || !std::ranges::all_of(value, plain)) throw InputError(kBadValue);
  return value;
}

// Of one of a field's names.
std::string FirstOf(const TextHeader& header, std::initializer_list<const char*> names) {
  return Plain(header.FirstOf(names));
}

void AddLine(std::string& text, const std::string& key, const char* separator, const std::string& value) {
  if (!value.empty()) text += key + separator + value + "\n";
}

// Lines are skipped before gunzip, bytes after it, so that both work for every encoding.
std::string NrrdText(const TextHeader& header, const std::string& data_file) {
  std::string text = "NRRD0005\n";
  const auto add = [&](const std::string& key, const std::string& value) { AddLine(text, key, ": ", value); };
  add("type", FirstOf(header, {"type"}));
  add("dimension", FirstOf(header, {"dimension"}));
  add("space", FirstOf(header, {"space"}));
  if (header.Value("space").empty())
    add("space dimension", FirstOf(header, {"space dimension", "spacedimension"}));
  add("sizes", FirstOf(header, {"sizes"}));
  add("spacings", FirstOf(header, {"spacings"}));
  add("axis mins", FirstOf(header, {"axis mins", "axismins"}));
  add("axis maxs", FirstOf(header, {"axis maxs", "axismaxs"}));
  add("centers", FirstOf(header, {"centers", "centerings"}));
  add("space directions", FirstOf(header, {"space directions", "spacedirections"}));
  add("kinds", FirstOf(header, {"kinds"}));
  add("endian", FirstOf(header, {"endian"}));
  add("encoding", FirstOf(header, {"encoding"}));
  add("space origin", FirstOf(header, {"space origin", "spaceorigin"}));
  const auto [lines, bytes] = VoxelStartOf(header);
  if (lines > 0) add("line skip", std::to_string(lines));
  if (bytes != 0) add("byte skip", std::to_string(bytes));
  return text + "data file: " + data_file + "\n";
}

std::string MetaText(const TextHeader& header, const std::string& data_file) {
  constexpr std::array kKept{
      std::pair("NDims", "ndims"),
      std::pair("BinaryData", "binarydata"),
      std::pair("BinaryDataByteOrderMSB", "binarydatabyteordermsb"),
      std::pair("ElementByteOrderMSB", "elementbyteordermsb"),
      std::pair("CompressedData", "compresseddata"),
      std::pair("TransformMatrix", "transformmatrix"),
      std::pair("Rotation", "rotation"),
      std::pair("Orientation", "orientation"),
      std::pair("Offset", "offset"),
      std::pair("Position", "position"),
      std::pair("Origin", "origin"),
      std::pair("ElementSpacing", "elementspacing"),
      std::pair("DimSize", "dimsize"),
      std::pair("ElementSize", "elementsize"),
      std::pair("ElementNumberOfChannels", "elementnumberofchannels"),
      std::pair("ElementType", "elementtype"),
  };
  std::string text = "ObjectType = Image\n";
  for (const auto& [name, key] : kKept) AddLine(text, name, " = ", FirstOf(header, {key}));
  const int64_t skipped = VoxelStartOf(header).bytes;
  if (skipped != 0) text += "HeaderSize = " + std::to_string(skipped) + "\n";
  if (IsPackedMeta(header))  // left to itself, ITK would count the header in
    text += "CompressedDataSize = " + std::to_string(PackedBytesOf(header)) + "\n";
  return text + "ElementDataFile = " + data_file + "\n";
}

std::string PathOf(int descriptor) { return "/proc/self/fd/" + std::to_string(descriptor); }

}  // namespace

std::string StandardHeaderText(const TextHeader& header, const std::string& data_file) {
  return header.format == FileFormat::kNrrd ? NrrdText(header, data_file) : MetaText(header, data_file);
}

StandardHeader::StandardHeader(const TextHeader& header)
    : voxels_(::open(header.voxels.c_str(), O_RDONLY | O_CLOEXEC)),
      header_(::memfd_create("header", MFD_CLOEXEC)) {
  if (voxels_ < 0 && IsDenial(errno))
    throw Denied("the volume file may not be read; ask its owner for the right to");
  if (voxels_ < 0) throw InputError("the volume file cannot be opened; may it be read?");
  const std::string text = StandardHeaderText(header, PathOf(voxels_));
  if (header_ < 0 || ::write(header_, text.data(), text.size()) != ssize_t(text.size()))
    throw Unavailable("there is no memory to read a volume's header");
}

StandardHeader::StandardHeader(StandardHeader&& other) noexcept
    : voxels_(std::exchange(other.voxels_, -1)), header_(std::exchange(other.header_, -1)) {}

StandardHeader::~StandardHeader() {
  for (const int descriptor : {voxels_, header_})
    if (descriptor >= 0) ::close(descriptor);
}

std::string StandardHeader::path() const { return PathOf(header_); }

}  // namespace kvx
