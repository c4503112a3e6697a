// Reads through zlib, which takes plain and gzipped files alike, a chunk at a time.
#include "pipeline/io/nifti_file.h"

#include <zlib.h>

#include <cerrno>
#include <memory>

#include "core/errors.h"
#include "pipeline/io/nifti_header.h"

namespace kvx {
namespace {

constexpr size_t kChunkBytes = size_t(1) << 20;  // a multiple of every voxel type
constexpr double kDeflateLimit = 1032;           // deflate never packs better than this

struct GzClose {
  void operator()(gzFile file) const { gzclose(file); }
};
using GzHandle = std::unique_ptr<gzFile_s, GzClose>;

const char kCutOff[] =
    "the file is cut off or damaged: its voxels cannot be read to the end; copy or convert it again";

GzHandle Open(const std::filesystem::path& path) {
  GzHandle file(gzopen(path.c_str(), "rb"));
  if (!file && IsDenial(errno))
    throw Denied("the volume file may not be read; ask its owner for the right to");
  if (!file) throw InputError("the volume file cannot be opened; check that it exists and may be read");
  gzbuffer(file.get(), 1 << 18);
  return file;
}

size_t ReadSome(gzFile file, std::span<char> out) {
  const int got = gzread(file, out.data(), unsigned(out.size()));
  if (got < 0) throw InputError(kCutOff);
  return size_t(got);
}

void ReadAll(gzFile file, std::span<char> out) {
  if (ReadSome(file, out) != out.size()) throw InputError(kCutOff);
}

// The checksum stands behind the data: reading on makes zlib look at it. A little may follow, but not as much
// again as the voxels.
void RequireSoundEnd(gzFile file, size_t voxel_bytes) {
  char more[4096];
  size_t beyond = 0, got = 0;
  do {
    got = ReadSome(file, more);
    beyond += got;
  } while (got > 0 && beyond < voxel_bytes);
  int status = Z_OK;
  gzerror(file, &status);
  if (status != Z_OK && status != Z_STREAM_END) throw InputError(kCutOff);
  if (beyond >= voxel_bytes) throw InputError(kHoldsTwice);
}

NiftiHeader ReadHeader(gzFile file, const std::filesystem::path& path) {
  std::string bytes(kLongestNiftiHeaderBytes, '\0');
  bytes.resize(ReadSome(file, bytes));
  const NiftiHeader header = ParseNiftiHeader(bytes);
  const double on_disk = double(std::filesystem::file_size(path));
  const double unpacked = gzdirect(file) ? on_disk - double(header.voxel_offset) : on_disk * kDeflateLimit;
  RequirePlausible(header.grid, header.type, std::max(1.0, unpacked));
  return header;
}

void ReadVoxels(gzFile file, const NiftiHeader& header, std::vector<float>& values) {
  if (gzseek(file, z_off_t(header.voxel_offset), SEEK_SET) < 0) throw InputError(kCutOff);
  const size_t width = BytesOf(header.type);
  const size_t all = header.grid.VoxelCount() * width;
  size_t left = all;
  values.reserve(header.grid.VoxelCount());
  std::vector<char> chunk(std::min(kChunkBytes, left));
  while (left > 0) {
    const std::span<char> part(chunk.data(), std::min(chunk.size(), left));
    ReadAll(file, part);
    if (header.swapped) SwapBytes(part, width);
    AppendRescaled(header.type, header.rescale, part, values);
    left -= part.size();
  }
  RequireSoundEnd(file, all);
}

}  // namespace

Scan ReadNifti(const std::filesystem::path& path) {
  const GzHandle file = Open(path);
  const NiftiHeader header = ReadHeader(file.get(), path);
  Scan scan;
  scan.volume.grid = header.grid;
  scan.stored_as = StoredAs(header.type, header.rescale);
  ReadVoxels(file.get(), header, scan.volume.values);
  return scan;
}

VolumeInfo ReadNiftiInfo(const std::filesystem::path& path) {
  const GzHandle file = Open(path);
  const NiftiHeader header = ReadHeader(file.get(), path);
  return {header.grid, StoredAs(header.type, header.rescale), ""};
}

}  // namespace kvx
