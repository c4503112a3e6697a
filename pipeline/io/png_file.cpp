// PNG by libpng's simplified interface.
#include "pipeline/io/png_file.h"

#include <png.h>

#include <cstring>

#include "core/errors.h"

namespace kvx {

void WritePng(const std::filesystem::path& path, const Picture& picture) {
  png_image image;
  std::memset(&image, 0, sizeof image);
  image.version = PNG_IMAGE_VERSION;
  image.width = png_uint_32(picture.width);
  image.height = png_uint_32(picture.height);
  image.format = PNG_FORMAT_RGB;
  if (!png_image_write_to_file(&image, path.c_str(), 0, picture.rgb.data(), 0, nullptr)) {
    throw Unavailable("a picture cannot be written; is the output folder writable and the disk not full?");
  }
}

}  // namespace kvx
