// An animation replaces an older one once all of its frames are there, or not at all.
#include "pipeline/io/sequence_file.h"

#include <gtest/gtest.h>

#include <fstream>

#include "core/errors.h"
#include "pipeline/io/volume_file.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

namespace fs = std::filesystem;
using testing_support::Content;

GreyPicture Grey(uint8_t grey) { return {2, 1, {grey, grey}}; }

void DrawFrames(FrameSink<GreyPicture>& sink, int count, uint8_t grey) {
  for (int frame = 0; frame < count; ++frame) sink.Add(Grey(grey));
}

size_t Files(const fs::path& folder) { return size_t(std::distance(fs::directory_iterator(folder), {})); }

TEST(SequenceFile, FramesOfAnInterruptedAnimationDoNotMixWithAnOlderOne) {
  const testing_support::ScratchFolder folder;
  const auto first = [&] { return Content(folder.path() / "frame_0000.png"); };
  const auto older = PictureFolder(folder.path());
  DrawFrames(*older, 3, 10);
  older->Finish();
  const std::string before = first();
  DrawFrames(*PictureFolder(folder.path()), 2, 200);  // never finished
  EXPECT_EQ(first(), before);
  EXPECT_EQ(Files(folder.path()), 3u);
  const auto newer = PictureFolder(folder.path());
  DrawFrames(*newer, 2, 200);
  newer->Finish();
  EXPECT_NE(first(), before);
  EXPECT_EQ(Files(folder.path()), 2u) << "the older one was longer";
}

TEST(SequenceFile, VolumesAppearWithTheLastOfThem) {
  const testing_support::ScratchFolder scratch;
  const fs::path folder = scratch.path() / "made" / "here";
  const Volume volume(Grid{.size = {2, 2, 2}});
  const auto sink = VolumeFolder(folder, ".nii.gz", ScalarType::kUint8);
  sink->Add(volume);
  EXPECT_FALSE(fs::exists(folder / "frame_0000.nii.gz"));
  sink->Finish();
  EXPECT_EQ(ReadVolumeInfo(folder / "frame_0000.nii.gz").grid, volume.grid);
  EXPECT_EQ(Files(folder), 1u);
}

// A wrong path is the caller's to mend, as no full disk is.
TEST(SequenceFile, WhereAFileIsNoFolderIsMade) {
  const testing_support::ScratchFolder scratch;
  std::ofstream(scratch.path() / "file") << "kept";
  for (const fs::path& folder : {scratch.path() / "file", scratch.path() / "file" / "frames"})
    EXPECT_THROW(VolumeFolder(folder, ".nii.gz", ScalarType::kUint8), InputError) << folder;
  EXPECT_EQ(Content(scratch.path() / "file"), "kept");
}

TEST(SequenceFile, ANameMayBeAsLongAsTheDiskTakes) {
  const testing_support::ScratchFolder folder;
  const fs::path path = folder.path() / (std::string(248, 'n') + ".nii.gz");
  const auto sink = NiftiSequence(path, ScalarType::kUint8, 1, 5);
  sink->Add(Volume(Grid{.size = {2, 2, 2}}));
  sink->Finish();
  EXPECT_EQ(Files(folder.path()), 1u);
}

}  // namespace
}  // namespace kvx
