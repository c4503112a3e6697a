// Pictures of slices for people to look at.
#pragma once
#include <cstdint>
#include <filesystem>
#include <vector>

namespace kvx {

// 8-bit RGB, row-major from the top left, three bytes a pixel.
struct Picture {
  int width = 0, height = 0;
  std::vector<uint8_t> rgb;
  Picture(int w, int h) : width(w), height(h), rgb(size_t(w) * h * 3) {}
  uint8_t* At(int x, int y) { return &rgb[(size_t(y) * width + x) * 3]; }
};

// 8-bit grey, row-major from the top left.
struct GreyPicture {
  int width = 0, height = 0;
  std::vector<uint8_t> grey;
};

void WritePng(const std::filesystem::path& path, const GreyPicture& picture);
void WritePng(const std::filesystem::path& path,
              const Picture& picture);  // throws Unavailable when it cannot be written

}  // namespace kvx
