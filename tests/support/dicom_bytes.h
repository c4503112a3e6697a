// DICOM files written element by element, without the libraries under test.
#pragma once
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

namespace kvx::testing_support {

// Elements in explicit, little-endian form (PS3.5, 7.1.2), each put behind the others.
class DicomBytes {
 public:
  DicomBytes& Text(uint32_t tag, const char* vr, std::string value) {
    if (value.size() % 2) value += std::string(vr) == "UI" ? '\0' : ' ';
    return Put(tag, vr, value);
  }
  DicomBytes& Short(uint32_t tag, uint16_t value) { return Put(tag, "US", Little(value, 2)); }
  DicomBytes& Words(uint32_t tag, const std::string& bytes) { return PutLong(tag, "OW", bytes); }
  DicomBytes& Floats(uint32_t tag, const std::string& bytes) { return PutLong(tag, "OF", bytes); }
  // Of packed voxels (PS3.5, A.4), behind an empty table of offsets.
  DicomBytes& Fragments(uint32_t tag, const std::vector<std::string>& fragments) {
    bytes_ += Tag(tag) + "OB" + std::string(2, '\0') + Little(0xffffffff, 4) + Tag(0xfffee000) + Little(0, 4);
    for (const std::string& fragment : fragments)
      bytes_ += Tag(0xfffee000) + Little(fragment.size(), 4) + fragment;
    bytes_ += Tag(0xfffee0dd) + Little(0, 4);
    return *this;
  }
  DicomBytes& Then(const DicomBytes& more) {
    bytes_ += more.bytes_;
    return *this;
  }
  DicomBytes& Sequence(uint32_t tag, const std::vector<DicomBytes>& items) {
    std::string content;
    for (const DicomBytes& item : items)
      content += Tag(0xfffee000) + Little(item.bytes_.size(), 4) + item.bytes_;
    return PutLong(tag, "SQ", content);
  }
  void WriteTo(const std::filesystem::path& path, const char* sop_class = kCtImage,
               const char* transfer_syntax = kExplicitLittleEndian) const {
    DicomBytes meta;
    meta.Text(0x00020002, "UI", sop_class).Text(0x00020003, "UI", "2.25.7");
    meta.Text(0x00020010, "UI", transfer_syntax);
    DicomBytes length;
    length.Put(0x00020000, "UL", Little(meta.bytes_.size(), 4));
    std::ofstream(path, std::ios::binary)
        << std::string(128, '\0') << "DICM" << length.bytes_ << meta.bytes_ << bytes_;
  }

  static constexpr char kCtImage[] = "1.2.840.10008.5.1.4.1.1.2";
  static constexpr char kMultiframeCapture[] = "1.2.840.10008.5.1.4.1.1.7.3";  // of grey words
  static constexpr char kEnhancedMrColour[] = "1.2.840.10008.5.1.4.1.1.4.3";
  static constexpr char kEnhancedCt[] = "1.2.840.10008.5.1.4.1.1.2.1";
  static constexpr char kSegmentation[] = "1.2.840.10008.5.1.4.1.1.66.4";
  static constexpr char kLabelMapSegmentation[] = "1.2.840.10008.5.1.4.1.1.66.7";

  static constexpr char kExplicitLittleEndian[] = "1.2.840.10008.1.2.1";
  static constexpr char kRunLengths[] = "1.2.840.10008.1.2.5";
  static constexpr char kJpeg2000[] = "1.2.840.10008.1.2.4.90";
  static constexpr char kMpeg4[] = "1.2.840.10008.1.2.4.102";
  static constexpr char kHighThroughputJpeg2000[] = "1.2.840.10008.1.2.4.201";

 private:
  static std::string Little(uint64_t value, int bytes) {
    std::string text;
    for (int b = 0; b < bytes; ++b) text += char(value >> (8 * b) & 255);
    return text;
  }
  static std::string Tag(uint32_t tag) { return Little(tag >> 16, 2) + Little(tag & 0xffff, 2); }
  DicomBytes& Put(uint32_t tag, const char* vr, const std::string& value) {
    bytes_ += Tag(tag) + vr + Little(value.size(), 2) + value;
    return *this;
  }
  DicomBytes& PutLong(uint32_t tag, const char* vr, const std::string& value) {
    bytes_ += Tag(tag) + vr + std::string(2, '\0') + Little(value.size(), 4) + value;
    return *this;
  }
  std::string bytes_;
};

// A CT slice of two by two voxels at z = `slice` mm.
struct CtSlice {
  int slice = 0;
  std::string slope = "1", intercept = "0", position;   // position: where it does not say, 0, 0, `slice`
  const char *modality = "CT", *shown = "MONOCHROME2";  // MONOCHROME1: the least grey is white
  std::string voxels = std::string("\3\0\3\0\3\0\3\0", 8);
  uint16_t bits = 16, is_signed = 1;
  const char* sop_class = DicomBytes::kCtImage;
  bool has_high_bit = true;
  std::optional<uint16_t> high_bit = {};  // bits - 1 where it does not say
  std::string axes = "1\\0\\0\\0\\1\\0", series = "2.25.4", spacing = "1\\1";
  DicomBytes more = {};  // with groups between 0028 and 7fe0
};

// Without the voxels.
inline DicomBytes HeaderOf(const CtSlice& of) {
  const std::string number = std::to_string(of.slice);
  const std::string position = of.position.empty() ? "0\\0\\" + number : of.position;
  DicomBytes image;
  image.Text(0x00080016, "UI", of.sop_class).Text(0x00080018, "UI", "2.25.1" + number);
  image.Text(0x00080060, "CS", of.modality)
      .Text(0x0020000d, "UI", "2.25.3")
      .Text(0x0020000e, "UI", of.series);
  image.Text(0x00200032, "DS", position).Text(0x00200037, "DS", of.axes);
  image.Short(0x00280002, 1).Text(0x00280004, "CS", of.shown).Short(0x00280010, 2).Short(0x00280011, 2);
  image.Text(0x00280030, "DS", of.spacing).Short(0x00280100, 16).Short(0x00280101, of.bits);
  if (of.has_high_bit) image.Short(0x00280102, of.high_bit.value_or(uint16_t(of.bits - 1)));
  image.Short(0x00280103, of.is_signed);
  image.Text(0x00281052, "DS", of.intercept).Text(0x00281053, "DS", of.slope);
  return image.Then(of.more);
}

inline DicomBytes ElementsOf(const CtSlice& of) { return HeaderOf(of).Words(0x7fe00010, of.voxels); }

inline void WriteCtSlice(const std::filesystem::path& path, const CtSlice& of) {
  ElementsOf(of).WriteTo(path);
}

inline void WriteCtSlice(const std::filesystem::path& path, int slice, const std::string& slope) {
  WriteCtSlice(path, {.slice = slice, .slope = slope});
}

}  // namespace kvx::testing_support
