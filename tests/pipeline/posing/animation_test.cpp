// Files of a moving hinge.
#include "pipeline/posing/animation.h"

#include <gtest/gtest.h>

#include <cstring>
#include <fstream>
#include <iterator>

#include "pipeline/io/sequence_file.h"
#include "pipeline/io/video_file.h"
#include "tests/support/fixtures.h"
#include "tests/support/hinge_world.h"

namespace kvx {
namespace {

using testing_support::HingeWorld;
using testing_support::ScratchFolder;
using testing_support::SharedBackend;

struct Animation : testing::Test {
  HingeWorld world;
  PosingEngine engine{SharedBackend(), world.Inputs()};
};

// Two bones and their hinge as a skeleton, for key frames.
struct HingeModel {
  explicit HingeModel(const HingeWorld& world) {
    fit.skeleton.joints = {{.child = 0},
                           {.child = 1,
                            .parent = 0,
                            .centre = world.hinge,
                            .dofs = {{.name = "flexion", .axis = world.across}}}};
    space = PoseSpace(fit);
    residuals = BoneResiduals(fit, {});
  }
  PoseResolver Resolver() const { return {bones, scans, neutral, fit, poses, space, residuals}; }
  std::vector<std::string> bones{"inner", "outer"}, scans;
  std::string neutral = "neutral";
  SkeletonFit fit;
  std::vector<PoseVector> poses;
  PoseSpace space;
  BoneResiduals residuals;
};

TEST_F(Animation, AFourDimensionalFileHoldsEveryFrameOnOneGrid) {
  const ScratchFolder scratch;
  const HingeModel model(world);
  const KeyFrames frames{
      4, Interpolation::kLinear, {{0, AnglePose{}}, {0.5, AnglePose{{{"outer.flexion", 0.6}}}}}};
  const Motion motion(model.Resolver(), frames, DeformationMode::kEvd);
  const Grid grid = AnimationGrid(engine, motion, frames);
  const auto path = scratch.path() / "bend.nii";
  AnimateVolumes(engine, motion, frames, grid, 0, *NiftiSequence(path, ScalarType::kFloat32, 3, 4), {});
  std::ifstream file(path, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(file)), {});
  ASSERT_EQ(bytes.size(), 352 + 3 * grid.VoxelCount() * 4);
  int16_t dim[8];
  std::memcpy(dim, bytes.data() + 40, sizeof dim);
  EXPECT_EQ(dim[0], 4);
  EXPECT_EQ(dim[3], grid.size.z());
  EXPECT_EQ(dim[4], 3);
  float step = 0;
  std::memcpy(&step, bytes.data() + 92, 4);
  EXPECT_FLOAT_EQ(step, 0.25f);
  const Volume last = engine.Pose(motion.At(0.5), grid).volume;
  std::vector<float> stored(grid.VoxelCount());
  std::memcpy(stored.data(), bytes.data() + 352 + 2 * stored.size() * 4, stored.size() * 4);
  EXPECT_EQ(stored, last.values);
  for (const double t : {0.0, 0.25, 0.5}) {  // every frame's body fits
    const Grid fitted = engine.FittedGrid(motion.At(t));
    const Eigen::Vector3d first = grid.ToVox(fitted.origin).ijk, end = first + fitted.size.cast<double>();
    EXPECT_GE(first.minCoeff(), -1e-6);
    EXPECT_LE((end - grid.size.cast<double>()).maxCoeff(), 1e-6);
  }
}

TEST_F(Animation, PicturesOfAMotionAreNumberedFilesOfOneSize) {
  const ScratchFolder scratch;
  const HingeModel model(world);
  const KeyFrames frames{
      2, Interpolation::kLinear, {{0, AnglePose{}}, {1, AnglePose{{{"outer.flexion", 0.6}}}}}};
  const Motion motion(model.Resolver(), frames, DeformationMode::kEvd);
  SliceRequest view;
  view.axis = SliceAxis::kCoronal, view.projection = Projection::kMaximum, view.pixel_mm = 2;
  view.window = {-50, 150};
  AnimatePictures(engine, motion, frames, AnimationGrid(engine, motion, frames), view, {},
                  *PictureFolder(scratch.path() / "p"));
  for (const char* name : {"frame_0000.png", "frame_0001.png", "frame_0002.png"}) {
    std::ifstream file(scratch.path() / "p" / name, std::ios::binary);
    std::string start(8, '\0');
    file.read(start.data(), 8);
    EXPECT_EQ(start.substr(1, 3), "PNG") << name;
  }
}

TEST_F(Animation, AVideoIsAFileThatTellsItsKind) {
  if (!HasVideoProgram()) GTEST_SKIP() << "ffmpeg is not installed";
  const ScratchFolder scratch;
  const HingeModel model(world);
  const KeyFrames frames{
      4, Interpolation::kLinear, {{0, AnglePose{}}, {1, AnglePose{{{"outer.flexion", 0.6}}}}}};
  const Motion motion(model.Resolver(), frames, DeformationMode::kEvd);
  SliceRequest view;
  view.axis = SliceAxis::kCoronal, view.projection = Projection::kMaximum;
  for (const auto& [name, magic, at] :
       {std::tuple{"a.mp4", "ftyp", 4}, std::tuple{"a.webm", "\x1A\x45\xDF\xA3", 0}}) {
    AnimatePictures(engine, motion, frames, AnimationGrid(engine, motion, frames), view,
                    WindowOf(world.scan.volume), *VideoFile(scratch.path() / name, frames.fps));
    std::ifstream file(scratch.path() / name, std::ios::binary);
    std::string start(8, '\0');
    ASSERT_TRUE(file.read(start.data(), 8)) << name;
    EXPECT_EQ(start.substr(size_t(at), 4), magic) << name;
  }
  std::ifstream file(scratch.path() / "a.mp4", std::ios::binary);
  const std::string mp4((std::istreambuf_iterator<char>(file)), {});
  ASSERT_NE(mp4.find("moov"), mp4.npos);
  EXPECT_LT(mp4.find("moov"), mp4.find("mdat")) << "the index first: a player need not have it all";
}

}  // namespace
}  // namespace kvx
