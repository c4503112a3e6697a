// What stands under the tags of a DICOM file that GDCM has read.
#pragma once
#include <gdcmDataSet.h>
#include <gdcmSequenceOfItems.h>
#include <gdcmTag.h>

#include <optional>
#include <string>
#include <vector>

namespace kvx {

using DicomSequences = std::vector<gdcm::SmartPointer<gdcm::SequenceOfItems>>;

// Without the blanks and zeros around it; nothing where it is absent.
std::string TextOf(const gdcm::DataSet& set, const gdcm::Tag& tag);

// Decimal strings separated by backslashes; nothing unless there are `count` finite ones.
std::optional<std::vector<double>> Numbers(const std::string& text, size_t count);

// Of 16 bits without a sign; nothing or 0 where it is absent.
bool HasNumber(const gdcm::DataSet& set, const gdcm::Tag& tag);
size_t NumberAt(const gdcm::DataSet& set, const gdcm::Tag& tag);

// The items of a sequence, none where it is absent; they point into `alive`.
std::vector<const gdcm::DataSet*> ItemsOf(const gdcm::DataSet& set, const gdcm::Tag& tag,
                                          DicomSequences& alive);

// Looks a value up where it may stand: in the frame's own groups, in the shared ones, or at the top of a
// plain image.
class FrameTags {
 public:
  explicit FrameTags(const gdcm::DataSet& top);
  size_t frame_count() const { return frames_.size(); }
  std::string Text(size_t frame, const gdcm::Tag& group, const gdcm::Tag& tag);
  size_t Number(size_t frame, const gdcm::Tag& group, const gdcm::Tag& tag);  // 0 where it is absent

 private:
  // Where the value stands.
  const gdcm::DataSet& SetWith(size_t frame, const gdcm::Tag& group, const gdcm::Tag& tag);

  const gdcm::DataSet& top_;
  DicomSequences alive_;  // items point into these
  const gdcm::DataSet* shared_ = nullptr;
  std::vector<const gdcm::DataSet*> frames_;
};

}  // namespace kvx
