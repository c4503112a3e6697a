// By libarchive, deflated.
#include "pipeline/io/zip_file.h"

#include <archive.h>
#include <archive_entry.h>

#include <fstream>

#include "core/errors.h"
#include "pipeline/io/atomic_file.h"

namespace kvx {
namespace {

constexpr time_t kZipEpoch = 315532800;  // 1980, the format's own beginning: no clock in the bytes

struct WriterFree {
  void operator()(archive* a) const { archive_write_free(a); }
};
struct EntryFree {
  void operator()(archive_entry* e) const { archive_entry_free(e); }
};

void RequireWritten(bool ok) {
  if (!ok)
    throw Unavailable(
        "a zip or .npz file cannot be written; is the output folder writable and the disk not full?");
}

}  // namespace

struct ZipFile::State {
  explicit State(const std::filesystem::path& path)
      : file(path), out(file.temporary(), std::ios::binary), zip(archive_write_new()) {}
  AtomicFile file;
  std::ofstream out;
  std::unique_ptr<archive, WriterFree> zip;  // writes to `out` until it is freed
};

namespace {

// libarchive is never told that writing failed: it would not free its compressor then. The stream remembers.
la_ssize_t Write(archive*, void* state, const void* bytes, size_t count) {
  static_cast<std::ofstream*>(state)->write(static_cast<const char*>(bytes), std::streamsize(count));
  return la_ssize_t(count);
}

}  // namespace

ZipFile::ZipFile(const std::filesystem::path& path) : state_(std::make_unique<State>(path)) {
  archive* zip = state_->zip.get();
  RequireWritten(archive_write_set_format_zip(zip) == ARCHIVE_OK &&
                 archive_write_zip_set_compression_deflate(zip) == ARCHIVE_OK &&
                 archive_write_set_bytes_in_last_block(zip, 1) == ARCHIVE_OK);
  RequireWritten(state_->out.is_open() &&
                 archive_write_open(zip, &state_->out, nullptr, Write, nullptr) == ARCHIVE_OK);
}

ZipFile::~ZipFile() = default;

void ZipFile::Add(const std::string& name, const std::string& bytes) {
  const std::unique_ptr<archive_entry, EntryFree> entry(archive_entry_new());
  archive_entry_set_pathname(entry.get(), name.c_str());
  archive_entry_set_size(entry.get(), la_int64_t(bytes.size()));
  archive_entry_set_filetype(entry.get(), AE_IFREG);
  archive_entry_set_perm(entry.get(), 0644);
  archive_entry_set_mtime(entry.get(), kZipEpoch, 0);
  archive* zip = state_->zip.get();
  RequireWritten(archive_write_header(zip, entry.get()) == ARCHIVE_OK);
  RequireWritten(archive_write_data(zip, bytes.data(), bytes.size()) == la_ssize_t(bytes.size()));
  RequireWritten(state_->out.good());
}

void ZipFile::Commit() {
  RequireWritten(archive_write_close(state_->zip.get()) == ARCHIVE_OK);
  state_->out.close();
  RequireWritten(!state_->out.fail());
  state_->file.Commit();
}

}  // namespace kvx
