// A disk that is full, played by the largest file that a process may write: whatever writes says so and
// leaves nothing.
#include <gtest/gtest.h>

#include "core/errors.h"
#include "pipeline/io/sequence_file.h"
#include "pipeline/io/volume_file.h"
#include "pipeline/io/zip_file.h"
#include "tests/support/fixtures.h"
#include "tests/support/small_disk.h"

namespace kvx {
namespace {
using namespace testing_support;
namespace fs = std::filesystem;

// Hard to pack, so that every format writes more than its buffers hold.
Volume Noise(const Grid& grid) {
  Volume out(grid);
  uint32_t state = 1;
  for (float& value : out.values) {
    state = state * 1664525u + 1013904223u;
    value = float(state >> 16);
  }
  return out;
}

size_t FilesIn(const fs::path& folder) {
  return size_t(std::distance(fs::directory_iterator(folder), fs::directory_iterator()));
}

// `write` makes the file at the path: refused for every room but the whole.
template <class Write>
void ExpectAllOrNothing(const std::string& name, const Write& write) {
  const ScratchFolder whole, small;
  write(whole.path() / name);
  const auto size = fs::file_size(whole.path() / name);
  ASSERT_GT(size, 4096u);
  for (const uintmax_t room :
       {uintmax_t(0), uintmax_t(100), uintmax_t(4096), size / 2, size - 4096, size - 1}) {
    const SmallDisk disk(room);
    EXPECT_THROW(write(small.path() / name), Unavailable) << name << ": " << room << " of " << size;
    EXPECT_EQ(FilesIn(small.path()), 0u) << name << ": " << room << " of " << size;
  }
  const SmallDisk disk(size);
  write(small.path() / name);
  EXPECT_EQ(Content(small.path() / name), Content(whole.path() / name));
}

TEST(FullDisk, VolumesLabelsAndFieldsAreWholeOrNotThere) {
  const Volume volume = Noise(ObliqueGrid({31, 29, 23}));
  LabelMap labels(volume.grid);
  for (size_t v = 0; v < labels.values.size(); ++v) labels.values[v] = uint16_t(volume.values[v]);
  DisplacementField field(volume.grid, Eigen::Vector3f::Zero());
  for (size_t v = 0; v < field.values.size(); ++v) field.values[v] = {volume.values[v], 1.0f, 2.0f};
  for (const std::string extension : {".nii", ".nii.gz", ".nrrd", ".mha"}) {
    ExpectAllOrNothing("a" + extension,
                       [&](const fs::path& path) { WriteVolume(path, volume, ScalarType::kFloat32); });
    ExpectAllOrNothing("b" + extension, [&](const fs::path& path) { WriteLabels(path, labels); });
    ExpectAllOrNothing("d" + extension, [&](const fs::path& path) { WriteField(path, field); });
  }
}

TEST(FullDisk, SequencesAreWholeOrNotThere) {
  const Volume volume = Noise(ObliqueGrid({31, 29, 23}));
  for (const std::string name : {"a.nii", "a.nii.gz"}) {
    ExpectAllOrNothing(name, [&](const fs::path& path) {
      const auto sink = NiftiSequence(path, ScalarType::kFloat32, 2, 10);
      sink->Add(volume);
      sink->Add(volume);
      sink->Finish();
    });
  }
}

TEST(FullDisk, ArchivesAreWholeOrNotThere) {
  const Volume noise = Noise(ObliqueGrid({31, 29, 23}));
  const std::string bytes(reinterpret_cast<const char*>(noise.values.data()), noise.values.size() * 4);
  ExpectAllOrNothing("a.zip", [&](const fs::path& path) {
    ZipFile zip(path);
    zip.Add("noise", bytes);
    zip.Commit();
  });
}

}  // namespace
}  // namespace kvx
