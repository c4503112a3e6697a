// Shared test worlds: oblique anisotropic off-centre grids,
// linear ramps, scratch folders, one backend per process.
#pragma once
#include <filesystem>

#include "core/image.h"
#include "core/rigid_transform.h"
#include "kernels/device/backend.h"

namespace kvx::testing_support {

Backend& SharedBackend();  // opened once; programs cached in a folder of the test process

Grid ObliqueGrid(const Eigen::Vector3i& size = {17, 13, 11});

// I(x) = offset + gradient . x, x in LPS mm: trilinear interpolation of it is exact.
struct LinearRamp {
  Eigen::Vector3d gradient_per_mm{0.3, -0.2, 0.5};
  double offset = 40.0;
  double At(const PointMm& x) const { return offset + gradient_per_mm.dot(x.lps); }
  Volume On(const Grid& grid) const;
};

// The field of a rigid motion: u(x) = T x - x on `grid`.
DisplacementField FieldOf(const RigidTransform& b_from_a, const Grid& grid);

// Between two axes: unit, their signs say nothing.
double BetweenAxesDeg(const Eigen::Vector3d& a, const Eigen::Vector3d& b);

// A folder of nobody else's, empty, that is removed with the object.
class ScratchFolder {
 public:
  ScratchFolder();
  ~ScratchFolder();
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

// All bytes of a file; empty where there is none.
std::string Content(const std::filesystem::path& file);

size_t FilesUnder(const std::filesystem::path& folder);  // in it and in the folders in it

// ../shared beside the repository, where it lies; tests that need it skip with a word where it does not.
std::filesystem::path SharedData();
bool HasSharedData();

}  // namespace kvx::testing_support
