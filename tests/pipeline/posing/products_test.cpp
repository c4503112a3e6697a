// Slices and posed surfaces of the hinge.
#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>

#include "core/errors.h"
#include "pipeline/posing/animation.h"
#include "pipeline/posing/inverse_grid.h"
#include "pipeline/posing/posed_surfaces.h"
#include "tests/support/fixtures.h"
#include "tests/support/hinge_world.h"

namespace kvx {
namespace {

using testing_support::HingeWorld;
using testing_support::ScratchFolder;
using testing_support::SharedBackend;

struct Products : testing::Test {
  HingeWorld world;
  PosingEngine engine{SharedBackend(), world.Inputs()};
  ResolvedPose bent = world.Posed(world.Bent(0.5));
};

// A plane through voxel centres of the template's grid must show what the posed volume holds there.
TEST_F(Products, ASliceIsThePlaneOfThePosedVolume) {
  const Grid grid = world.scan.volume.grid;
  const Volume volume = engine.Pose(bent, grid).volume;
  Grid plane = grid;
  const int k = grid.size.z() / 2;
  plane.size.z() = 1;
  plane.origin = grid.ToMm(0, 0, k);
  const Volume slice = engine.Pose(bent, plane).volume;
  double worst = 0;
  size_t inside = 0;
  for (int j = 0; j < grid.size.y(); ++j) {
    for (int i = 0; i < grid.size.x(); ++i) {
      if (volume(i, j, k) == HingeWorld::kAir || slice(i, j, 0) == HingeWorld::kAir) continue;
      ++inside;
      worst = std::max(worst, std::abs(double(volume(i, j, k)) - slice(i, j, 0)));
    }
  }
  EXPECT_GT(inside, 60u);
  EXPECT_LT(worst, 0.5);
}

TEST_F(Products, AnObliqueSliceOfTheTemplateShowsItsTexture) {
  SliceRequest request;
  request.oblique = {world.hinge, world.along, world.across + 0.3 * world.along};
  request.pixel_mm = 0.5;
  request.width_mm = 30, request.height_mm = 10;
  const Volume slice = PosedSlice(engine, world.Posed(world.Bent(0)), request);
  EXPECT_EQ(slice.grid.size, Eigen::Vector3i(60, 20, 1));
  EXPECT_NEAR(slice.grid.direction.col(0).dot(slice.grid.direction.col(1)), 0, 1e-12);
  size_t inside = 0;
  for (size_t v = 0; v < slice.values.size(); ++v) {
    const PointMm x = slice.grid.ToMm(PointVox{slice.grid.Ijk(v).cast<double>()});
    if (!world.DeepInside(x, 3)) continue;
    ++inside;
    EXPECT_NEAR(slice.values[v], world.TextureAt(x), 6);
  }
  EXPECT_GT(inside, 200u);
}

TEST(SliceGrid, AxesLieAsRadiologistsLookAndWhereTheyAreAskedFor) {
  Grid body = testing_support::ObliqueGrid();
  SliceRequest request;
  request.at_mm = 12.5;
  const Grid axial = SliceGrid(request, body);
  EXPECT_NEAR(axial.origin.lps.z(), 12.5, 1e-9);
  EXPECT_EQ(axial.direction.col(0), Eigen::Vector3d(1, 0, 0)) << "the patient's left is on the right";
  EXPECT_EQ(axial.direction.col(1), Eigen::Vector3d(0, 1, 0)) << "posterior is below";
  request.axis = SliceAxis::kSagittal;
  const Grid sagittal = SliceGrid(request, body);
  EXPECT_NEAR(sagittal.origin.lps.x(), 12.5, 1e-9);
  EXPECT_EQ(sagittal.direction.col(1), Eigen::Vector3d(0, 0, -1)) << "inferior is below";
  request.oblique = {{{0, 0, 0}}, {1, 0, 0}, {2, 0, 0}};
  EXPECT_THROW(SliceGrid(request, body), InputError);
  request.oblique.reset();
  request.pixel_mm = 1e-4;
  EXPECT_THROW(SliceGrid(request, body), InputError);
}

// What a picture says of itself asks for the same frame in any pose: its centre, directions, size and pixel.
TEST(SliceGrid, AFrameIsHeldByWhatAPictureSaysOfItself) {
  const Grid body = testing_support::ObliqueGrid();
  Grid of_another_pose = body;
  of_another_pose.size += Eigen::Vector3i(9, 4, 7);
  of_another_pose.origin.lps += Eigen::Vector3d(-13, 5, 21);
  for (const SliceAxis axis : {SliceAxis::kAxial, SliceAxis::kCoronal, SliceAxis::kSagittal}) {
    SliceRequest first;
    first.axis = axis, first.at_mm = 3.5;
    const Grid shown = SliceGrid(first, body);
    const PointMm centre = shown.ToMm(PointVox{(shown.size.cast<double>().array() - 1) / 2});
    SliceRequest held;
    held.oblique = {centre, shown.direction.col(0), shown.direction.col(1)};
    held.width_mm = shown.size.x() * shown.spacing_mm.x();
    held.height_mm = shown.size.y() * shown.spacing_mm.y();
    held.pixel_mm = shown.spacing_mm.x();
    const Grid again = SliceGrid(held, of_another_pose);
    EXPECT_EQ(again.size, shown.size);
    EXPECT_TRUE(again.origin.lps.isApprox(shown.origin.lps, 1e-9));
    EXPECT_TRUE(again.direction.isApprox(shown.direction, 1e-9));
    EXPECT_NE(SliceGrid(first, of_another_pose).origin.lps, shown.origin.lps) << "otherwise it moves";
  }
}

// Fine pixels see no more along the line of sight than the template has.
TEST(SliceGrid, ASlabIsAsThickAsAskedForWhateverThePixels) {
  const Grid body = testing_support::ObliqueGrid();
  const double finest_mm = body.spacing_mm.minCoeff();
  SliceRequest request;
  request.at_mm = 31, request.projection = Projection::kMean;
  for (const double slab_mm : {0.3, 2.5, 3.0, 4.8}) {
    request.slab_mm = slab_mm;
    for (const double pixel_mm : {0.1, 0.8, 1.1, 2.4, 10.0}) {
      request.pixel_mm = pixel_mm;
      const Grid grid = SliceGrid(request, body);
      const double apart_mm = std::max(pixel_mm, finest_mm);
      EXPECT_NEAR(grid.size.z() * grid.spacing_mm.z(), slab_mm, 1e-9) << pixel_mm;
      EXPECT_LE(grid.spacing_mm.z(), apart_mm + 1e-6);
      EXPECT_LT((grid.size.z() - 1) * apart_mm, slab_mm) << "no more layers than that";
      EXPECT_NEAR(grid.Middle().lps.z(), 31, 1e-9);
    }
  }
}

TEST(SliceGrid, AWholeBodyIsSeenThroughInFinePixelsToo) {
  const Grid body = testing_support::ObliqueGrid({40, 40, 40});
  SliceRequest request;
  request.projection = Projection::kMaximum;
  request.pixel_mm = body.spacing_mm.minCoeff();
  const int layers = SliceGrid(request, body).size.z();
  request.pixel_mm = body.spacing_mm.minCoeff() / 16;
  EXPECT_EQ(SliceGrid(request, body).size.z(), layers);
  request.pixel_mm = body.spacing_mm.minCoeff() / 32;
  try {
    SliceGrid(request, body);
    FAIL() << "of few enough pixels, but too many voxels behind them";
  } catch (const InputError& error) {
    EXPECT_NE(std::string(error.what()).find("'slab_mm'"), std::string::npos) << error.what();
  }
  request.slab_mm = 5;
  EXPECT_NO_THROW(SliceGrid(request, body));
}

TEST_F(Products, AMeanIsOfItsSlabWhateverThePixels) {
  SliceRequest request;
  request.oblique = {world.hinge, world.along, world.across};
  request.width_mm = 12, request.height_mm = 6;
  constexpr double kSlabMm = 2.2, kStepMm = 0.1;
  for (const double pixel_mm : {0.5, 2.0}) {
    request.pixel_mm = pixel_mm;
    request.projection = Projection::kMean, request.slab_mm = kSlabMm;
    const Volume mean = PosedSlice(engine, bent, request);
    EXPECT_EQ(mean.grid.spacing_mm, Eigen::Vector3d::Constant(pixel_mm));
    request.projection = Projection::kNone, request.slab_mm.reset();
    std::vector<double> expected(mean.values.size());
    constexpr int kSlices = 22;
    for (int k = 0; k < kSlices; ++k) {
      SliceRequest thin = request;
      thin.oblique->centre.lps += ((k + 0.5) * kStepMm - kSlabMm / 2) * mean.grid.direction.col(2);
      const Volume slice = PosedSlice(engine, bent, thin);
      for (size_t v = 0; v < expected.size(); ++v) expected[v] += slice.values[v] / kSlices;
    }
    double difference = 0;
    for (size_t v = 0; v < expected.size(); ++v)
      difference += std::abs(mean.values[v] - expected[v]) / double(expected.size());
    EXPECT_LT(difference, 0.2) << pixel_mm;
  }
}

TEST_F(Products, TheMaximumProjectionIsTheBrightestOfItsSlab) {
  SliceRequest request;
  request.projection = Projection::kMaximum;
  request.pixel_mm = 2;
  const ResolvedPose pose = world.Posed(world.Bent(0.2));
  const Volume projected = PosedSlice(engine, pose, request);
  EXPECT_EQ(projected.grid.size.z(), 1);
  request.projection = Projection::kNone;
  float most = -1e9f;
  for (double z = -40; z <= 40; z += 2) {
    request.at_mm = world.hinge.lps.z() + z;
    for (const float value : PosedSlice(engine, pose, request).values) most = std::max(most, value);
  }
  const float projected_most = *std::max_element(projected.values.begin(), projected.values.end());
  EXPECT_NEAR(projected_most, most, 8);
}

// A level makes the picture smaller, and what is thin or noisy fainter; so does a held frame's pixel size.
TEST_F(Products, APictureAtALevelIsTheMeanOfTheFullOnesPixels) {
  const double finest_mm = world.scan.volume.grid.spacing_mm.minCoeff();
  SliceRequest request;
  request.oblique = {world.hinge, world.along, world.across};
  request.width_mm = 32 * finest_mm, request.height_mm = 16 * finest_mm;
  for (const Projection projection : {Projection::kNone, Projection::kMaximum, Projection::kMean}) {
    request.projection = projection;
    request.slab_mm.reset(), request.pixel_mm.reset();
    if (projection != Projection::kNone) request.slab_mm = 5 * finest_mm;
    request.level = 0;
    const Volume full = PosedSlice(engine, bent, request);
    ASSERT_EQ(full.grid.size, Eigen::Vector3i(32, 16, 1));
    request.level = 2;
    const Volume quarter = PosedSlice(engine, bent, request);
    ASSERT_EQ(quarter.grid.size, Eigen::Vector3i(8, 4, 1));
    EXPECT_TRUE(quarter.grid.spacing_mm.isApprox(4 * full.grid.spacing_mm));
    EXPECT_TRUE(quarter.grid.Middle().lps.isApprox(full.grid.Middle().lps, 1e-9));
    for (int j = 0; j < 4; ++j) {
      for (int i = 0; i < 8; ++i) {
        double sum = 0;
        for (int n = 0; n < 16; ++n) sum += full(4 * i + n % 4, 4 * j + n / 4, 0);
        EXPECT_NEAR(quarter(i, j, 0), sum / 16, 0.01) << i << ", " << j;
      }
    }
    request.pixel_mm = 4 * finest_mm;
    EXPECT_EQ(PosedSlice(engine, bent, request).values, quarter.values);
    request.level = 0;
    EXPECT_NE(PosedSlice(engine, bent, request).values, quarter.values) << "without a level as asked for";
    request.level = 2, request.pixel_mm = finest_mm;
    EXPECT_EQ(PosedSlice(engine, bent, request).values, full.values) << "never finer than the template";
  }
}

// A small limit on posed grids, as the service has, refuses no coarse picture.
TEST_F(Products, APictureAtALevelNeedsNoMoreVoxelsThanMayBePosed) {
  SliceRequest request;
  request.projection = Projection::kMaximum;
  const PosingEngine small(SharedBackend(), world.Inputs(), 8000);
  EXPECT_THROW(PosedSlice(small, bent, request, world.scan.volume.grid), InputError);
  request.level = 3;
  const Volume picture = PosedSlice(small, bent, request, world.scan.volume.grid);
  EXPECT_EQ(picture.grid.size.z(), 1);
  EXPECT_GT(*std::max_element(picture.values.begin(), picture.values.end()), HingeWorld::kAir);
}

TEST_F(Products, BonesMoveAsAWholeAndTheSkinFollows) {
  const TemplateSurfaces surfaces(world.bones, world.body);
  const auto all = surfaces.Posed(engine, bent, {});
  ASSERT_EQ(all.size(), 3u);
  EXPECT_EQ(all[1].name, "outer");
  EXPECT_TRUE(all[1].scan_from_mesh.isApprox(bent.scan_from_template[1].Matrix()));
  EXPECT_TRUE(all[2].is_skin);
  for (const NamedSurface& surface : all) EXPECT_TRUE(IsClosed(surface.mesh)) << surface.name;
  const auto still = surfaces.Posed(engine, world.Posed(world.Bent(0)), {.skin = true});
  ASSERT_EQ(still.size(), 1u);
  const double body_mm3 = double(std::count(world.body.values.begin(), world.body.values.end(), 1)) *
                          world.body.grid.spacing_mm.prod();
  EXPECT_NEAR(EnclosedVolumeMm3(still[0].mesh) / body_mm3, 1, 0.06);
  for (size_t v = 0; v < still[0].mesh.vertices_mm.size(); ++v) {
    const PointMm x{still[0].mesh.vertices_mm[v].cast<double>()};
    if (world.along.dot(x.lps - world.hinge.lps) < world.blend_mm + 3) continue;
    const Eigen::Vector3d moved = (bent.scan_from_template[1] * x).lps;
    EXPECT_LT((all[2].mesh.vertices_mm[v].cast<double>() - moved).norm(), 0.05)
        << "beyond the hinge the skin is rigid";
  }
  EXPECT_THROW(surfaces.Posed(engine, bent, {.bones = {"nobone"}}), NotFound);
}

TEST_F(Products, TheCoarseInverseTakesPosedTissueBackWithinItsStatedError) {
  const InverseGrid inverse = CoarseInverse(engine, world.body, bent, 1);
  const DisplacementField& field = inverse.template_from_posed;
  EXPECT_LE(inverse.mean_error_mm, inverse.p99_error_mm);
  EXPECT_LE(inverse.p99_error_mm, inverse.largest_error_mm);
  EXPECT_LT(inverse.mean_error_mm, 0.15);
  double worst = 0;
  for (double s = -15; s <= 15; s += 1.5) {
    const PointMm x{world.hinge.lps + s * world.along};
    const PointMm y = engine.MapPoints(bent, {x})[0];
    worst = std::max(worst, (y.lps + SampleTrilinear(field, field.grid.ToVox(y)) - x.lps).norm());
  }
  EXPECT_LE(worst, inverse.largest_error_mm + 0.05);
  const InverseGrid still = CoarseInverse(engine, world.body, world.Posed(world.Bent(0)), 2);
  EXPECT_LT(still.largest_error_mm, 1e-3) << "the identity is linear";
}

TEST_F(Products, ACoarseInverseThatNobodyWaitsForEndsWhereverItIs) {
  std::atomic<int> looks{0};
  CoarseInverse(engine, world.body, bent, 1, Progress({}, [&] { return ++looks, false; }));
  const int all = looks;
  EXPECT_GT(all, 3) << "samples, the nearest of them, nodes";
  for (const int enough : {1, all / 2, all}) {
    looks = 0;
    EXPECT_THROW(CoarseInverse(engine, world.body, bent, 1, Progress({}, [&] { return ++looks >= enough; })),
                 Cancelled)
        << enough;
  }
}

TEST_F(Products, AProjectionsUsualWindowIsOfWhatItShows) {
  SliceRequest view;
  view.axis = SliceAxis::kCoronal;
  const Window of_template = WindowOf(world.scan.volume);
  const Volume slice = PosedSlice(engine, bent, view);
  EXPECT_EQ(ShownWindow(view, slice, of_template).high, of_template.high);
  view.window = {-50, 150};
  EXPECT_EQ(ShownWindow(view, slice, of_template).high, 150) << "asked for";
  view.window.reset();
  view.projection = Projection::kMaximum;
  const Volume layer = PosedSlice(engine, bent, view);
  const GreyPicture picture = PictureOf(layer, ShownWindow(view, layer, of_template));
  const auto white = std::count(picture.grey.begin(), picture.grey.end(), 255);
  EXPECT_LE(double(white), 0.015 * double(picture.grey.size()) + 1);
}

}  // namespace
}  // namespace kvx
