// Unpacks once and throws away what comes out, chunk by chunk: zlib checks the stream on its way.
#include "pipeline/io/sound_voxels.h"

#include <zlib.h>

#include <algorithm>
#include <cctype>
#include <fstream>
#include <limits>
#include <vector>

#include "core/errors.h"
#include "core/text/lower_case.h"

namespace kvx {
namespace {

constexpr size_t kChunkBytes = size_t(1) << 18;
constexpr int kGzipOrZlib = 15 + 32;  // the longest window; zlib tells the two apart
constexpr uint8_t kGzipMark = 0x1f;
constexpr uint64_t kNoLimit = std::numeric_limits<int64_t>::max();

const char kCutOff[] =
    "the file is cut off or damaged: its voxels cannot be read to the end; copy or convert it again";
const char kOtherLength[] =
    "the file's packed voxels are not as many as its header describes; its header is wrong or it is damaged; "
    "convert the original images again";

class Unpacker {
 public:
  // `members`: a gzip file may be made of several streams, one behind the other.
  explicit Unpacker(bool members) : members_(members), scratch_(kChunkBytes) {
    if (inflateInit2(&stream_, kGzipOrZlib) != Z_OK)
      throw Unavailable("there is no memory to unpack a volume");
  }
  ~Unpacker() { inflateEnd(&stream_); }
  Unpacker(const Unpacker&) = delete;
  Unpacker& operator=(const Unpacker&) = delete;

  // The bytes that come of it.
  uint64_t Take(std::vector<char>& part) {
    stream_.next_in = reinterpret_cast<Bytef*>(part.data());
    stream_.avail_in = uInt(part.size());
    uint64_t unpacked = 0;
    while (!ended_ && (stream_.avail_in > 0 || full_)) {
      stream_.next_out = reinterpret_cast<Bytef*>(scratch_.data());
      stream_.avail_out = uInt(scratch_.size());
      const int status = inflate(&stream_, Z_NO_FLUSH);
      if (status != Z_OK && status != Z_STREAM_END && status != Z_BUF_ERROR) throw InputError(kCutOff);
      full_ = stream_.avail_out == 0;
      unpacked += scratch_.size() - stream_.avail_out;
      ended_ = status == Z_STREAM_END;
      if (ended_ && stream_.avail_in > 0) GoOn(char(*stream_.next_in));
    }
    return unpacked;
  }
  bool ended() const { return ended_; }
  // After the end: whether `next` begins another stream.
  bool GoOn(char next) {
    ended_ = !members_ || uint8_t(next) != kGzipMark || inflateReset(&stream_) != Z_OK;
    return !ended_;
  }

 private:
  bool members_ = false;
  z_stream stream_{};
  std::vector<char> scratch_;
  bool ended_ = false, full_ = false;
};

// At most `limit` bytes of `in`; stops where more than `most` came out.
uint64_t UnpackedBytes(std::istream& in, bool members, uint64_t limit, uint64_t most) {
  Unpacker unpacker(members);
  std::vector<char> part;
  uint64_t unpacked = 0;
  while (limit > 0 && unpacked <= most) {
    part.resize(size_t(std::min<uint64_t>(kChunkBytes, limit)));
    in.read(part.data(), std::streamsize(part.size()));
    part.resize(size_t(in.gcount()));
    if (part.empty() || (unpacker.ended() && !unpacker.GoOn(part.front()))) break;
    limit -= part.size();
    unpacked += unpacker.Take(part);
  }
  if (!unpacker.ended() && unpacked <= most) throw InputError(kCutOff);
  return unpacked;
}

// In front of packed voxels lines, or the bytes of a MetaImage; the bytes of a NRRD are packed with them.
std::ifstream OpenAtVoxels(const TextHeader& header) {
  std::ifstream in(header.voxels, std::ios::binary);
  const VoxelStart start = VoxelStartOf(header);
  if (header.format == FileFormat::kMeta) {
    in.seekg(std::max<int64_t>(0, start.bytes));
    return in;
  }
  in.seekg(header.attached ? header.bytes : 0);
  for (int64_t line = header.attached ? header.lines : 0; line < start.lines && in; ++line)
    in.ignore(std::numeric_limits<std::streamsize>::max(), '\n');
  return in;
}

void RequireAsLong(uint64_t unpacked, uint64_t expected) {
  if (unpacked < expected) throw InputError(kCutOff);
  if (unpacked > expected) throw InputError(kOtherLength);
}

void RequirePackedNrrd(const TextHeader& header, uint64_t bytes) {
  std::ifstream in = OpenAtVoxels(header);
  const int64_t skipped = VoxelStartOf(header).bytes;
  const bool from_end = skipped < 0;  // what is in front may be of any length
  const uint64_t expected = bytes + uint64_t(std::max<int64_t>(0, skipped));
  const uint64_t unpacked = UnpackedBytes(in, true, kNoLimit, from_end ? kNoLimit : expected);
  RequireAsLong(from_end ? std::min(unpacked, expected) : unpacked, expected);
}

void RequirePackedMeta(const TextHeader& header, uint64_t bytes) {
  std::ifstream in = OpenAtVoxels(header);
  const auto packed = uint64_t(std::max<int64_t>(0, PackedBytesOf(header)));
  RequireAsLong(UnpackedBytes(in, false, packed, bytes), bytes);
}

void RequireNumbers(const TextHeader& header, uint64_t values) {
  std::ifstream in = OpenAtVoxels(header);
  std::vector<char> part(kChunkBytes);
  uint64_t numbers = 0;
  bool within = false;
  while (in.read(part.data(), std::streamsize(part.size())), in.gcount() > 0) {
    for (std::streamsize at = 0; at < in.gcount(); ++at) {
      const bool space = std::isspace(uint8_t(part[size_t(at)]));
      numbers += !space && !within;
      within = !space;
    }
  }
  if (numbers < values) throw InputError(kCutOff);
}

// A file may end in something else, but not in as much again. A header that skips a part of a file of voxels
// alone knows that there is more in it.
void RequireNotTwice(const TextHeader& header, size_t bytes) {
  const auto [lines, start] = VoxelStartOf(header);
  const bool from_begin = header.attached ? start >= 0 : start == 0;
  const bool of_lines = header.format == FileFormat::kNrrd && lines != (header.attached ? header.lines : 0);
  if (from_begin && !of_lines && MostVoxelBytes(header) >= 2.0 * double(bytes)) throw InputError(kHoldsTwice);
}

}  // namespace

void RequireSoundVoxels(const TextHeader& header, size_t values, size_t bytes) {
  if (header.format == FileFormat::kNrrd) {  // ITK notices where raw voxels or text end early
    const std::string encoding = LowerCase(header.Value("encoding"));
    if (encoding.starts_with("gz")) RequirePackedNrrd(header, bytes);
    if (encoding == "raw") RequireNotTwice(header, bytes);
  } else if (IsPackedMeta(header)) {
    RequirePackedMeta(header, bytes);
  } else if (IsTextMeta(header)) {
    RequireNumbers(header, values);
  } else {
    RequireNotTwice(header, bytes);
  }
}

}  // namespace kvx
