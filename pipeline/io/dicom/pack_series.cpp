// What is broken is packed too: whoever reads the series says so.
#include "pipeline/io/dicom/pack_series.h"

#include <archive.h>
#include <archive_entry.h>

#include <algorithm>
#include <fstream>
#include <memory>

#include "core/errors.h"
#include "pipeline/io/dicom/series_folder.h"

namespace kvx {
namespace {

namespace fs = std::filesystem;

constexpr char kNotPacked[] = "the series cannot be packed; is there room for temporary files?";
constexpr char kNotRead[] =
    "an image of the series cannot be read to its end; check the disk it lies on, and that nothing writes it";

struct CloseWriter {
  void operator()(archive* a) const { archive_write_free(a); }
};
struct FreeEntry {
  void operator()(archive_entry* e) const { archive_entry_free(e); }
};
using Writer = std::unique_ptr<archive, CloseWriter>;
using Entry = std::unique_ptr<archive_entry, FreeEntry>;

std::vector<fs::path> ImagesIn(const fs::path& folder) {
  std::vector<fs::path> files = SeriesFiles(folder);
  std::erase_if(files, [](const fs::path& file) { return SeriesFileAt(file) == SeriesFile::kAside; });
  return files;
}

Writer OpenWriter(const fs::path& path) {
  Writer writer(archive_write_new());
  archive_write_set_format_pax_restricted(writer.get());
  archive_write_add_filter_gzip(writer.get());
  archive_write_set_filter_option(writer.get(), "gzip", "timestamp", nullptr);  // no clock in the bytes
  if (archive_write_open_filename(writer.get(), path.c_str()) != ARCHIVE_OK) throw Unavailable(kNotPacked);
  return writer;
}

void AddSlice(archive* writer, const fs::path& file, size_t index) {
  const Entry entry(archive_entry_new());
  const std::string number = std::to_string(index);
  const std::string zeros(5 - std::min<size_t>(5, number.size()), '0');
  archive_entry_set_pathname(entry.get(), ("slice_" + zeros + number + ".dcm").c_str());
  const uintmax_t size = fs::file_size(file);
  archive_entry_set_size(entry.get(), la_int64_t(size));
  archive_entry_set_filetype(entry.get(), AE_IFREG);
  archive_entry_set_perm(entry.get(), 0600);
  archive_write_header(writer, entry.get());
  std::vector<char> buffer(1 << 16);
  std::ifstream in(file, std::ios::binary);
  uintmax_t packed = 0;
  while (in.read(buffer.data(), std::streamsize(buffer.size())) || in.gcount() > 0) {
    archive_write_data(writer, buffer.data(), size_t(in.gcount()));
    packed += uintmax_t(in.gcount());
  }
  if (in.bad() || packed != size)
    throw InputError(kNotRead);  // zeros would be packed in the place of the rest
}

}  // namespace

void PackSeries(const fs::path& folder, const fs::path& archive, const Progress& progress) {
  const std::vector<fs::path> files = ImagesIn(folder);
  if (files.empty()) throw InputError("the folder of the series holds no DICOM images");
  const Writer writer = OpenWriter(archive);
  for (size_t i = 0; i < files.size(); ++i) {
    progress.Report("packing", double(i) / double(files.size()));
    AddSlice(writer.get(), files[i], i);
  }
  if (archive_write_close(writer.get()) != ARCHIVE_OK) throw Unavailable(kNotPacked);
}

}  // namespace kvx
