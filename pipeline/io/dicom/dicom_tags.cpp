#include "pipeline/io/dicom/dicom_tags.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>

namespace kvx {

using gdcm::DataSet;
using gdcm::Tag;

std::string TextOf(const DataSet& set, const Tag& tag) {
  if (!set.FindDataElement(tag)) return "";
  const gdcm::ByteValue* bytes = set.GetDataElement(tag).GetByteValue();
  if (!bytes) return "";
  std::string text(bytes->GetPointer(), bytes->GetLength());
  text.erase(std::remove(text.begin(), text.end(), '\0'), text.end());
  const size_t first = text.find_first_not_of(' ');
  return first == std::string::npos ? "" : text.substr(first, text.find_last_not_of(' ') - first + 1);
}

std::optional<std::vector<double>> Numbers(const std::string& text, size_t count) {
  std::vector<double> numbers;
  const char* at = text.data();
  const char* const end = at + text.size();
  while (at < end) {
    while (at < end && (*at == ' ' || *at == '+')) ++at;
    double number = 0;
    const auto [next, error] = std::from_chars(at, end, number);
    if (error != std::errc() || !std::isfinite(number)) return std::nullopt;
    numbers.push_back(number);
    at = next;
    while (at < end && *at == ' ') ++at;
    if (at < end && *at++ != '\\') return std::nullopt;
  }
  if (numbers.size() != count) return std::nullopt;
  return numbers;
}

std::vector<const DataSet*> ItemsOf(const DataSet& set, const Tag& tag, DicomSequences& alive) {
  std::vector<const DataSet*> items;
  if (!set.FindDataElement(tag)) return items;
  const gdcm::SmartPointer<gdcm::SequenceOfItems> sequence = set.GetDataElement(tag).GetValueAsSQ();
  if (!sequence) return items;
  alive.push_back(sequence);
  for (size_t i = 1; i <= sequence->GetNumberOfItems(); ++i)
    items.push_back(&sequence->GetItem(i).GetNestedDataSet());
  return items;
}

bool HasNumber(const DataSet& set, const Tag& tag) {
  if (!set.FindDataElement(tag)) return false;
  const gdcm::ByteValue* bytes = set.GetDataElement(tag).GetByteValue();
  return bytes && bytes->GetLength() >= 2;
}

size_t NumberAt(const DataSet& set, const Tag& tag) {
  if (!HasNumber(set, tag)) return 0;
  const gdcm::ByteValue* bytes = set.GetDataElement(tag).GetByteValue();
  return size_t(uint8_t(bytes->GetPointer()[0])) | size_t(uint8_t(bytes->GetPointer()[1]))
                                                       << 8;  // GDCM swaps while reading
}

FrameTags::FrameTags(const DataSet& top) : top_(top) {
  const auto shared = ItemsOf(top, Tag(0x5200, 0x9229), alive_);
  shared_ = shared.empty() ? nullptr : shared.front();
  frames_ = ItemsOf(top, Tag(0x5200, 0x9230), alive_);
}

const DataSet& FrameTags::SetWith(size_t frame, const Tag& group, const Tag& tag) {
  for (const DataSet* groups : {frame < frames_.size() ? frames_[frame] : nullptr, shared_}) {
    if (!groups) continue;
    const auto items = ItemsOf(*groups, group, alive_);
    if (!items.empty() && items.front()->FindDataElement(tag)) return *items.front();
  }
  return top_;
}

std::string FrameTags::Text(size_t frame, const Tag& group, const Tag& tag) {
  return TextOf(SetWith(frame, group, tag), tag);
}

size_t FrameTags::Number(size_t frame, const Tag& group, const Tag& tag) {
  return NumberAt(SetWith(frame, group, tag), tag);
}

}  // namespace kvx
