// libarchive does the formats; only zip and tar (plain or gzip) are switched on.
#include "storage/files/archive.h"

#include <archive.h>
#include <archive_entry.h>
#include <fcntl.h>
#include <locale.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <memory>
#include <span>

#include "core/digest.h"
#include "core/errors.h"
#include "core/text/series_file.h"

namespace kvx {
namespace {

namespace fs = std::filesystem;

constexpr char kDamaged[] = "the archive is damaged or is not a zip or tar file";

struct CloseReader {
  void operator()(archive* a) const { archive_read_free(a); }
};
using Reader = std::unique_ptr<archive, CloseReader>;

// libarchive turns names that an archive says are UTF-8 into the locale's, and says that the plain one, which
// programs start with, has none for 手.
class LocaleOfAnyName {
 public:
  LocaleOfAnyName() {
    if (any_) before_ = ::uselocale(any_);
  }
  ~LocaleOfAnyName() {
    if (!any_) return;
    ::uselocale(before_);
    ::freelocale(any_);
  }
  LocaleOfAnyName(const LocaleOfAnyName&) = delete;
  LocaleOfAnyName& operator=(const LocaleOfAnyName&) = delete;

 private:
  const locale_t any_ = ::newlocale(LC_CTYPE_MASK, "C.UTF-8", nullptr);
  locale_t before_ = nullptr;  // of this thread
};

Reader OpenReader(const fs::path& path) {
  Reader reader(archive_read_new());
  archive_read_support_format_zip_seekable(reader.get());  // by its list at the end: what has none is cut off
  archive_read_support_format_tar(reader.get());
  archive_read_support_filter_gzip(reader.get());
  if (archive_read_open_filename(reader.get(), path.c_str(), 1 << 16) != ARCHIVE_OK)
    throw InputError(kDamaged);
  return reader;
}

bool Climbs(const fs::path& path) {
  return path.is_absolute() || std::ranges::any_of(path, [](const fs::path& part) { return part == ".."; });
}

// False after the last entry. A name in another script than the archive says is no damage: nobody needs it.
bool NextEntry(archive* reader, archive_entry*& entry) {
  const int status = archive_read_next_header(reader, &entry);
  if (status == ARCHIVE_EOF || status == ARCHIVE_OK) return status == ARCHIVE_OK;
  const char* const complaint = archive_error_string(reader);
  const bool of_its_name = complaint && std::string_view(complaint).starts_with("Pathname");
  if (status != ARCHIVE_WARN || !of_its_name) throw InputError(kDamaged);
  return true;
}

// A tar ends with blocks of zeros; without them it was cut off between two files. What packs it has an end of
// its own.
void RequireEnd(archive* reader) {
  const bool tar = (archive_format(reader) & ARCHIVE_FORMAT_BASE_MASK) == ARCHIVE_FORMAT_TAR;
  const bool plain = archive_filter_code(reader, 0) == ARCHIVE_FILTER_NONE;
  if (!tar || !plain || archive_filter_bytes(reader, 0) > archive_read_header_position(reader)) return;
  throw InputError("the archive is cut off: its end is missing; pack the series again, or send it again");
}

fs::path NameOf(archive_entry* entry) {
  const char* name = archive_entry_pathname(entry);
  return name ? name : "";
}

// Throws for what an honest archive of slices does not hold; false for what is left out.
bool IsSlice(archive_entry* entry) {
  const fs::path path = NameOf(entry);
  if (Climbs(path))
    throw InputError("the archive holds paths that leave its folder; pack the series folder alone");
  if (archive_entry_filetype(entry) == AE_IFDIR) return false;
  if (archive_entry_filetype(entry) != AE_IFREG || archive_entry_hardlink(entry)) {
    throw InputError("the archive holds links or devices; pack plain files only");
  }
  return !IsNamedAside(path);
}

struct Tally {
  const ArchiveLimits& limits;
  const std::function<void(size_t)>& unpacked;
  int64_t packed_bytes;
  int64_t entries = 0, bytes = 0;

  void AddEntry() {
    if (++entries > limits.entries) throw InputError("the archive holds too many files for one series");
  }
  void AddBytes(int64_t count) {
    bytes += count;
    if (bytes > limits.total_bytes) throw InputError("the archive is too large when unpacked");
    if (bytes > limits.ratio_from_bytes && bytes / std::max<int64_t>(1, packed_bytes) > limits.ratio) {
      throw InputError("the archive unpacks to far more than its size; send the files less compressed");
    }
    if (unpacked) unpacked(size_t(count));
  }
};

// What is broken stays: whoever reads the series says so. A folder whose name is not known is an empty file.
bool LiesAside(const fs::path& file, const fs::path& name) {
  std::string head(kSeriesFileHead, '\0');
  std::ifstream in(file, std::ios::binary);
  in.read(head.data(), std::streamsize(head.size()));
  head.resize(size_t(in.gcount()));
  if (name.empty() && head.empty()) return true;
  return SeriesFileOf(name.filename().string(), head) == SeriesFile::kAside;
}

// Reads an entry's bytes, which count whether they are kept or not: unpacking them costs the same.
template <class Take>
void ReadEntry(archive* reader, Tally& tally, const Take& take) {
  const void* block = nullptr;
  size_t size = 0;
  la_int64_t offset = 0;
  int status = ARCHIVE_OK;
  while ((status = archive_read_data_block(reader, &block, &size, &offset)) == ARCHIVE_OK) {
    tally.AddBytes(int64_t(size));
    take(static_cast<const char*>(block), size, offset);
  }
  if (status != ARCHIVE_EOF) throw InputError(kDamaged);
}

// False for a file that is left out.
bool UnpackOne(archive* reader, archive_entry* entry, const fs::path& folder, Tally& tally) {
  const fs::path temporary = folder / "incoming";
  std::ofstream out(temporary, std::ios::binary | std::ios::trunc);
  Hasher hasher;
  la_int64_t expected = 0;
  ReadEntry(reader, tally, [&](const char* bytes, size_t size, la_int64_t offset) {
    if (offset != expected) throw InputError("the archive holds sparse files; pack plain files only");
    hasher.Raw(std::as_bytes(std::span(bytes, size)));
    out.write(bytes, std::streamsize(size));
    expected += la_int64_t(size);
  });
  out.close();
  if (!out) throw Unavailable("the archive cannot be unpacked; is the disk full?");
  if (LiesAside(temporary, NameOf(entry))) return !fs::remove(temporary);
  fs::rename(temporary, folder / (hasher.Finish().Hex().substr(0, 32) + ".dcm"));
  return true;
}

}  // namespace

int UnpackSeries(const fs::path& path, const fs::path& folder, const ArchiveLimits& limits,
                 const std::function<void(size_t)>& unpacked) {
  const LocaleOfAnyName locale;
  const Reader reader = OpenReader(path);
  Tally tally{limits, unpacked, int64_t(fs::file_size(path))};
  int files = 0;
  archive_entry* entry = nullptr;
  while (NextEntry(reader.get(), entry)) {
    tally.AddEntry();
    if (archive_entry_is_encrypted(entry))
      throw InputError("the archive is encrypted; send it without a password");
    if (IsSlice(entry))
      files += UnpackOne(reader.get(), entry, folder, tally);
    else
      ReadEntry(reader.get(), tally, [](const char*, size_t, la_int64_t) {});
  }
  RequireEnd(reader.get());
  if (files == 0) {
    throw InputError(
        "the archive holds no DICOM images; send a volume (.nii.gz, .nrrd, .mha) as it is, without an "
        "archive");
  }
  return files;
}

}  // namespace kvx
