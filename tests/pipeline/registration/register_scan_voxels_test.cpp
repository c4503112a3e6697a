// Scans whose voxels are not the template's: thick slices, finer ones, between its own, filled up by a
// program.
#include <gtest/gtest.h>

#include <algorithm>

#include "pipeline/scans/finer_scan.h"
#include "tests/support/limb.h"

namespace kvx {
namespace {
using namespace testing_support;
using namespace testing_support::limb;

// Slices three times as thick as their pixels, a whole wave of the lumps every two to three of them. On these
// voxels as they are the error is 0.37 pixels.
TEST(RegisterScan, ThickSlicesDoNotWidenWhatIsTakenForOnePlace) {
  Grid thick = LimbGrid({48, 48, 16});
  thick.spacing_mm.z() *= 3;
  thick.origin.lps.z() = kSpacing;
  const RegisteredScan result = Register(Render(thick, Identity, 1), Render(thick, TemplateFromWideBump, 2));
  EXPECT_EQ(result.scan_from_template.grid, thick);
  EXPECT_EQ(result.place_error_steps.grid, thick);
  const Errors errors = Compare(result, WideBump, kSpacing);
  EXPECT_LT(errors.mean_mm, 0.3 * kSpacing);
  EXPECT_LT(errors.bone_mm, 1e-3);
  EXPECT_EQ(result.folded_fraction, 0);
}

// Means over so many planes.
Scan OfThickSlices(const Scan& scan, int planes) {
  Grid grid = scan.volume.grid;
  grid.size.z() /= planes;
  grid.origin.lps.z() += 0.5 * (planes - 1) * grid.spacing_mm.z();
  grid.spacing_mm.z() *= planes;
  Scan out{Volume(grid)};
  for (size_t v = 0; v < out.volume.values.size(); ++v) {
    const Eigen::Vector3i p = grid.Ijk(v);
    for (int k = 0; k < planes; ++k)
      out.volume.values[v] += scan.volume(p.x(), p.y(), planes * p.z() + k) / float(planes);
  }
  return out;
}

// Compared with the sharp template as it is, it leaves an error of 0.5 voxels.
TEST(RegisterScan, AScanOfThickSlicesIsNotTakenForSharp) {
  const RegisteredScan result = Register(Render(LimbGrid(), Identity, 1),
                                         OfThickSlices(Render(LimbGrid(), TemplateFromWideBump, 2), 4));
  const Errors errors = Compare(result, WideBump, kSpacing);
  EXPECT_LT(errors.mean_mm, 0.4 * kSpacing);
}

// Voxels half as wide, eight of which have the noise of one of the other scans' here. Taken one by one they
// leave an error of 0.36 voxels.
TEST(RegisterScan, AScanFinerThanTheTemplateSaysAsMuchAsOneOfItsKind) {
  const double sigma = 4 * std::sqrt(8.0);
  Grid fine = LimbGrid({96, 96, 96});
  fine.spacing_mm /= 2;
  fine.origin.lps = Eigen::Vector3d::Constant(-kSpacing / 4);
  const Scan coarse{AsCoarseAs(Render(fine, Identity, 1, 1, 0, sigma).volume, kSpacing)};
  const RegisteredScan result = Register(coarse, Render(fine, TemplateFromBumped, 2, 1, 0, sigma));
  const Errors errors = Compare(result, Bump, kSpacing);
  EXPECT_LT(errors.mean_mm, 0.31 * kSpacing);
}

Scan FilledUp(const Scan& scan, int planes) {
  Scan out = scan;
  out.volume.grid.size.z() += planes;
  out.volume.values.resize(out.volume.grid.VoxelCount(), 0.0f);
  return out;
}

// The first planes of both, which may have more.
float LargestDifferenceMm(const DisplacementField& a, const DisplacementField& b, int planes) {
  float largest_mm = 0;
  for (size_t v = 0; v < size_t(planes) * a.grid.size.x() * a.grid.size.y(); ++v)
    largest_mm = std::max(largest_mm, (a.values[v] - b.values[v]).norm());
  return largest_mm;
}

TEST(RegisterScan, PlanesThatAProgramFilledUpSayNothing) {
  const Grid short_grid = LimbGrid({48, 48, 36});
  const Scan t = Render(LimbGrid(), Identity, 1), s = Render(short_grid, TemplateFromBumped, 2);
  const RegisteredScan filled = Register(t, FilledUp(s, 12)), cut = Register(t, s);
  EXPECT_LT(LargestDifferenceMm(filled.scan_from_template, cut.scan_from_template, 48), 1e-3);
  EXPECT_EQ(filled.place_error_steps.values, cut.place_error_steps.values);
  const Scan short_t = Render(short_grid, Identity, 1), long_s = Render(LimbGrid(), TemplateFromBumped, 2);
  EXPECT_LT(LargestDifferenceMm(Register(FilledUp(short_t, 12), long_s).scan_from_template,
                                Register(short_t, long_s).scan_from_template, 36),
            0.15);  // 0.6 where smoothing carries the filling into the template
}

// Splines between thick slices would bend what was filled up to values of its own.
TEST(RegisterScan, SlicesThatAProgramFilledUpAreKnownBetweenThickOnesToo) {
  Grid thick = LimbGrid({48, 48, 12});
  thick.spacing_mm.z() *= 3;
  const Scan t = Render(thick, Identity, 1), s = Render(LimbGrid(), TemplateFromBumped, 2);
  EXPECT_LT(LargestDifferenceMm(Register(FilledUp(t, 4), s).scan_from_template,
                                Register(t, s).scan_from_template, 12),
            0.2);  // 0.56 with a spline through the filling
}

// Half of the limb is beyond the field of view, which lies obliquely in a grid that is zero around it.
bool InView(const Eigen::Vector3d& x) {
  return (x - kCentre).cwiseAbs().maxCoeff() <= 36 && x.z() - kCentre.z() <= 9;
}

// Of body voxels that lie beyond the view by so much: how many have a stated error.
int StatedBeyondView(const RegisteredScan& result, double by_mm) {
  const Mask& steps = result.place_error_steps;
  int stated = 0;
  for (size_t v = 0; v < steps.values.size(); ++v) {
    Eigen::Vector3d x = steps.grid.ToMm(PointVox{steps.grid.Ijk(v).cast<double>()}).lps;
    x += result.scan_from_template.values[v].cast<double>() - Eigen::Vector3d(0, 0, by_mm);
    stated += !InView(x) && steps.values[v] != kPlaceErrorUnknown;
  }
  return stated;
}

TEST(RegisterScan, CornersThatAProgramFilledUpSayNothing) {
  Grid turned = LimbGrid({72, 72, 72});
  turned.direction = Eigen::AngleAxisd(0.5, Eigen::Vector3d::UnitX()).toRotationMatrix();
  turned.origin.lps = kCentre - turned.direction * Eigen::Vector3d::Constant(0.5 * 71 * kSpacing);
  Scan s = Render(turned, TemplateFromBumped, 2);
  for (size_t v = 0; v < s.volume.values.size(); ++v) {
    if (!InView(turned.ToMm(PointVox{turned.Ijk(v).cast<double>()}).lps)) s.volume.values[v] = 0;
  }
  const RegisteredScan result = Register(Render(LimbGrid(), Identity, 1), s);
  EXPECT_LT(Compare(result, Bump, kSpacing).mean_mm, 0.27 * kSpacing);  // 0.84 where they are taken for air
  EXPECT_EQ(StatedBeyondView(result, kSpacing), 0);
}

// Read linearly, a scan is less sharp and less noisy half way between its voxels than at them: here that
// leaves an error of 0.44 voxels, and of 0.36 where the voxels lie as the template's.
TEST(RegisterScan, WhereTheScansVoxelsLieMattersLittle) {
  const double noise_sigma = 12;
  Grid between = LimbGrid();
  between.origin.lps += Eigen::Vector3d::Constant(0.5 * kSpacing);
  const Scan still = Render(LimbGrid(), Identity, 1, 1, 0, noise_sigma);
  for (const Grid& grid : {LimbGrid(), between}) {
    const RegisteredScan result = Register(still, Render(grid, TemplateFromBumped, 2, 1, 0, noise_sigma));
    EXPECT_LT(Compare(result, Bump, 0.2 * kSpacing).mean_mm, 0.25 * kSpacing);
  }
}

}  // namespace
}  // namespace kvx
