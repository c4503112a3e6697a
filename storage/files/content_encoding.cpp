// The fast end of both codings: what is encoded here is sent once or a few times.
#include "storage/files/content_encoding.h"

#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <charconv>
#include <fstream>
#include <memory>
#include <string_view>

#include "core/errors.h"

namespace kvx {
namespace {

constexpr size_t kChunk = 1 << 20;
constexpr int kGzipLevel = 1, kZstdLevel = 1;

std::string_view Trimmed(std::string_view text) {
  while (text.starts_with(' ') || text.starts_with('\t')) text.remove_prefix(1);
  while (text.ends_with(' ') || text.ends_with('\t')) text.remove_suffix(1);
  return text;
}

// "gzip;q=0.5" -> 0.5; 1 without a weight.
double WeightOf(std::string_view parameters) {
  const size_t at = parameters.find("q=");
  if (at == parameters.npos) return 1;
  double weight = 0;
  std::from_chars(parameters.data() + at + 2, parameters.data() + parameters.size(), weight);
  return weight;
}

class Output {
 public:
  explicit Output(const std::filesystem::path& path) : out_(path, std::ios::binary) {}
  void Write(const char* bytes, size_t count) {
    if (!out_.write(bytes, std::streamsize(count)))
      throw Unavailable("a result cannot be stored; is the disk full?");
  }
  void Close() {
    out_.close();
    if (!out_) throw Unavailable("a result cannot be stored; is the disk full?");
  }

 private:
  std::ofstream out_;
};

// Calls take(bytes, count, last) over the file from `begin` on.
template <class Take>
void ForChunks(const CachedFile& file, size_t begin, const Take& take) {
  std::string chunk(kChunk, '\0');
  for (size_t at = begin; at <= file.size();) {
    const size_t count = file.ReadAt(at, chunk.data(), std::min(kChunk, file.size() - at));
    at += count;
    take(chunk.data(), count, at >= file.size());
    if (count == 0 || at >= file.size()) return;
  }
}

void WriteGzip(const CachedFile& from, size_t begin, Output& out) {
  z_stream stream{};
  if (deflateInit2(&stream, kGzipLevel, Z_DEFLATED, 15 + 16, 8, Z_DEFAULT_STRATEGY) != Z_OK)
    throw Unavailable("there is not enough memory to compress a result");
  const std::unique_ptr<z_stream, int (*)(z_stream*)> guard(&stream, deflateEnd);
  std::string packed(kChunk, '\0');
  ForChunks(from, begin, [&](char* bytes, size_t count, bool last) {
    stream.next_in = reinterpret_cast<Bytef*>(bytes);
    stream.avail_in = uInt(count);
    do {
      stream.next_out = reinterpret_cast<Bytef*>(packed.data());
      stream.avail_out = uInt(packed.size());
      deflate(&stream, last ? Z_FINISH : Z_NO_FLUSH);
      out.Write(packed.data(), packed.size() - stream.avail_out);
    } while (stream.avail_out == 0);
  });
}

void WriteZstd(const CachedFile& from, size_t begin, Output& out) {
  const std::unique_ptr<ZSTD_CCtx, size_t (*)(ZSTD_CCtx*)> context(ZSTD_createCCtx(), ZSTD_freeCCtx);
  if (!context) throw Unavailable("there is not enough memory to compress a result");
  ZSTD_CCtx_setParameter(context.get(), ZSTD_c_compressionLevel, kZstdLevel);
  std::string packed(ZSTD_CStreamOutSize(), '\0');
  ForChunks(from, begin, [&](const char* bytes, size_t count, bool last) {
    ZSTD_inBuffer in{bytes, count, 0};
    for (bool done = false; !done;) {
      ZSTD_outBuffer piece{packed.data(), packed.size(), 0};
      const size_t left =
          ZSTD_compressStream2(context.get(), &piece, &in, last ? ZSTD_e_end : ZSTD_e_continue);
      if (ZSTD_isError(left)) throw Unavailable("a result cannot be compressed");
      out.Write(packed.data(), piece.pos);
      done = last ? left == 0 : in.pos == in.size;
    }
  });
}

}  // namespace

const char* NameOf(Encoding encoding) {
  return encoding == Encoding::kGzip ? "gzip" : encoding == Encoding::kZstd ? "zstd" : "";
}

Encoding BestEncoding(const std::string& accept_encoding) {
  double gzip = -1, zstd = -1, any = 0;
  std::string_view rest = accept_encoding;
  while (!rest.empty()) {
    const size_t end = std::min(rest.find(','), rest.size());
    const std::string_view item = Trimmed(rest.substr(0, end));
    rest.remove_prefix(std::min(end + 1, rest.size()));
    const size_t name_end = std::min(item.find(';'), item.size());
    const std::string_view name = Trimmed(item.substr(0, name_end));
    const double weight = WeightOf(item.substr(name_end));
    if (name == "gzip" || name == "x-gzip") gzip = weight;
    if (name == "zstd") zstd = weight;
    if (name == "*") any = weight;
  }
  if (gzip < 0) gzip = any;
  if (zstd < 0) zstd = any;
  if (zstd <= 0 && gzip <= 0) return Encoding::kIdentity;
  return zstd >= gzip ? Encoding::kZstd : Encoding::kGzip;
}

void WriteEncoded(const CachedFile& from, size_t plain_bytes, Encoding encoding,
                  const std::filesystem::path& to) {
  Output out(to);
  std::string plain(std::min(plain_bytes, from.size()), '\0');
  from.ReadAt(0, plain.data(), plain.size());
  out.Write(plain.data(), plain.size());
  if (encoding == Encoding::kGzip)
    WriteGzip(from, plain.size(), out);
  else if (encoding == Encoding::kZstd)
    WriteZstd(from, plain.size(), out);
  else
    ForChunks(from, plain.size(), [&](const char* bytes, size_t count, bool) { out.Write(bytes, count); });
  out.Close();
}

}  // namespace kvx
