// PNG by libpng's simplified interface.
#include "pipeline/io/png_file.h"

#include <png.h>

#include <cstring>

#include "core/errors.h"

namespace kvx {
namespace {

void Write(const std::filesystem::path& path, int width, int height, png_uint_32 format,
           const std::vector<uint8_t>& bytes) {
  png_image image;
  std::memset(&image, 0, sizeof image);
  image.version = PNG_IMAGE_VERSION;
  image.width = png_uint_32(width);
  image.height = png_uint_32(height);
  image.format = format;
  if (!png_image_write_to_file(&image, path.c_str(), 0, bytes.data(), 0, nullptr)) {
    throw Unavailable("a picture cannot be written; is the output folder writable and the disk not full?");
  }
}

}  // namespace

void WritePng(const std::filesystem::path& path, const GreyPicture& picture) {
  Write(path, picture.width, picture.height, PNG_FORMAT_GRAY, picture.grey);
}

void WritePng(const std::filesystem::path& path, const Picture& picture) {
  Write(path, picture.width, picture.height, PNG_FORMAT_RGB, picture.rgb);
}

}  // namespace kvx
