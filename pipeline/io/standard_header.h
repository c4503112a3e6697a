// A NRRD or MetaImage header in our own words, for ITK: the fields that matter, checked, and where the voxels
// are. It lies in memory and names the voxels' file by a descriptor, so that nothing of the original header
// is parsed a second time, and no name of a file either.
#pragma once
#include <string>

#include "pipeline/io/text_header.h"

namespace kvx {

class StandardHeader {
 public:
  // Throws InputError for values that are no numbers or words, and for files that cannot be opened.
  explicit StandardHeader(const TextHeader& header);
  StandardHeader(StandardHeader&& other) noexcept;
  StandardHeader& operator=(StandardHeader&&) = delete;
  ~StandardHeader();

  std::string path() const;  // valid as long as this object is there

 private:
  int voxels_ = -1, header_ = -1;
};

// Its text, with the voxels in `data_file`.
std::string StandardHeaderText(const TextHeader& header, const std::string& data_file);

}  // namespace kvx
