// 4-D NIfTI: the header that ITK writes for one frame, told about time, then the voxels of all frames.
#include "pipeline/io/sequence_file.h"

#include <zlib.h>

#include <cstring>
#include <fstream>
#include <random>

#include "core/errors.h"
#include "core/text/extension.h"
#include "pipeline/io/atomic_file.h"
#include "pipeline/io/nifti_header.h"
#include "pipeline/io/volume_file.h"
#include "pipeline/io/voxel_values.h"

namespace kvx {
namespace {

namespace fs = std::filesystem;
const char* const kCannotWrite =
    "the animation cannot be written; is the output folder writable and the disk not full?";

template <class T>
void Put(std::string& header, size_t at, T value) {
  std::memcpy(header.data() + at, &value, sizeof value);
}

// Field positions of the NIfTI-1 standard.
std::string HeaderOf(const fs::path& beside, const Volume& first, ScalarType type, int frames, double fps) {
  const AtomicFile scratch(beside.parent_path() / "header.nii");
  WriteVolume(scratch.temporary(), Volume(first.grid), type);
  std::ifstream file(scratch.temporary(), std::ios::binary);
  std::string header(kNifti1VoxelOffset, '\0');
  if (!file.read(header.data(), std::streamsize(header.size()))) throw Unavailable(kCannotWrite);
  Put<int16_t>(header, 40, 4);                // dim[0]
  Put<int16_t>(header, 48, int16_t(frames));  // dim[4]
  Put<float>(header, 92, float(1 / fps));     // pixdim[4]
  Put<char>(header, 123, 2 | 8);              // millimetres, seconds
  return header;
}

class NiftiSink final : public FrameSink<Volume> {
 public:
  NiftiSink(const fs::path& path, ScalarType type, int frames, double fps)
      : path_(path), file_(path), type_(type), frames_(frames), fps_(fps) {
    if (frames > 32767)
      throw InputError("a NIfTI file holds at most 32767 frames; use a smaller fps or a folder");
  }
  ~NiftiSink() override {
    if (out_) gzclose(out_);
  }
  void Add(const Volume& frame) override {
    if (!out_) Open(frame);
    Write(Packed(type_, frame.values));
    ++written_;
  }
  void Finish() override {
    const bool closed = out_ && gzclose(out_) == Z_OK;
    out_ = nullptr;
    if (!closed || written_ != frames_) throw Unavailable(kCannotWrite);
    file_.Commit();
  }

 private:
  void Open(const Volume& first) {
    const std::string header = HeaderOf(path_, first, type_, frames_, fps_);
    const bool compressed = HasExtension(path_, ".gz");
    out_ = gzopen(file_.temporary().c_str(), compressed ? "wb1" : "wbT");
    if (!out_) throw Unavailable(kCannotWrite);
    Write(header);
  }
  void Write(const std::string& bytes) {
    constexpr size_t kAtOnce = size_t(1) << 30;
    for (size_t at = 0; at < bytes.size(); at += kAtOnce) {
      const auto count = unsigned(std::min(kAtOnce, bytes.size() - at));
      if (gzwrite(out_, bytes.data() + at, count) != int(count)) throw Unavailable(kCannotWrite);
    }
  }

  const fs::path path_;
  AtomicFile file_;
  const ScalarType type_;
  const int frames_;
  const double fps_;
  gzFile out_ = nullptr;
  int written_ = 0;
};

std::string Numbered(int frame, const std::string& extension) {
  char name[32];
  std::snprintf(name, sizeof name, "frame_%04d", frame);
  return name + extension;
}

// Frames of a folder, which may hold an older animation: they wait in a folder of their own until all are
// there, and then replace it. An animation that ends before leaves the older one whole.
class FrameFolder {
 public:
  FrameFolder(fs::path folder, std::string extension)
      : folder_(std::move(folder)), extension_(std::move(extension)), waiting_(folder_ / WaitingName()) {
    std::error_code error;
    fs::create_directories(waiting_, error);
    if (IsDenial(error))
      throw Denied("the output folder may not be made; choose a place where you may write");
    if (error == std::errc::not_a_directory || error == std::errc::file_exists)
      throw InputError("the output folder cannot be made where a file is; choose another place");
    if (error) throw Unavailable("the output folder cannot be made; is the disk full?");
  }
  ~FrameFolder() {
    std::error_code ignored;
    fs::remove_all(waiting_, ignored);
  }
  FrameFolder(const FrameFolder&) = delete;
  FrameFolder& operator=(const FrameFolder&) = delete;

  fs::path Next() { return waiting_ / Numbered(count_++, extension_); }  // to be written now
  void Commit() {
    std::error_code error;
    for (int frame = 0; frame < count_ && !error; ++frame)
      fs::rename(waiting_ / Numbered(frame, extension_), folder_ / Numbered(frame, extension_), error);
    if (error) throw Unavailable(kCannotWrite);
    for (int frame = count_; fs::remove(folder_ / Numbered(frame, extension_), error);) ++frame;
    fs::remove(waiting_, error);
  }

 private:
  static std::string WaitingName() { return ".part-" + std::to_string(std::random_device()()); }

  const fs::path folder_;
  const std::string extension_;
  const fs::path waiting_;
  int count_ = 0;
};

class VolumeFolderSink final : public FrameSink<Volume> {
 public:
  VolumeFolderSink(const fs::path& folder, const std::string& extension, ScalarType type)
      : frames_(folder, extension), type_(type) {}
  void Add(const Volume& frame) override { WriteVolume(frames_.Next(), frame, type_); }
  void Finish() override { frames_.Commit(); }

 private:
  FrameFolder frames_;
  const ScalarType type_;
};

class PictureFolderSink final : public FrameSink<GreyPicture> {
 public:
  explicit PictureFolderSink(const fs::path& folder) : frames_(folder, ".png") {}
  void Add(const GreyPicture& frame) override {
    AtomicFile file(frames_.Next());
    WritePng(file.temporary(), frame);
    file.Commit();
  }
  void Finish() override { frames_.Commit(); }

 private:
  FrameFolder frames_;
};

}  // namespace

std::unique_ptr<FrameSink<Volume>> NiftiSequence(const fs::path& path, ScalarType type, int frames,
                                                 double fps) {
  return std::make_unique<NiftiSink>(path, type, frames, fps);
}

std::unique_ptr<FrameSink<Volume>> VolumeFolder(const fs::path& folder, const std::string& extension,
                                                ScalarType type) {
  return std::make_unique<VolumeFolderSink>(folder, extension, type);
}

std::unique_ptr<FrameSink<GreyPicture>> PictureFolder(const fs::path& folder) {
  return std::make_unique<PictureFolderSink>(folder);
}

}  // namespace kvx
