// Shared test worlds.
#include "tests/support/fixtures.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <stdexcept>

namespace kvx::testing_support {
namespace {

std::filesystem::path NewFolder(const std::filesystem::path& in, const std::string& name) {
  std::string path = in / (name + "XXXXXX");
  if (!::mkdtemp(path.data())) throw std::runtime_error("no folder for a test's files can be made");
  return path;
}

// Where the scratch folders of a test program lie, also those of its death tests: these are processes of
// their own, which end without removing anything and find the folder in the environment.
class FolderOfTheProgram {
 public:
  FolderOfTheProgram() {
    if (const char* of_parent = std::getenv(kVariable)) {
      path_ = of_parent;
      return;
    }
    path_ = NewFolder(std::filesystem::temp_directory_path(), "kinevox-test-");
    made_by_ = ::getpid();
    ::setenv(kVariable, path_.c_str(), 1);
  }
  ~FolderOfTheProgram() {
    std::error_code ignored;
    if (made_by_ == ::getpid()) std::filesystem::remove_all(path_, ignored);
  }
  const std::filesystem::path& path() const { return path_; }

 private:
  static constexpr const char* kVariable = "KVX_TEST_SCRATCH";
  std::filesystem::path path_;
  pid_t made_by_ = 0;
};

// From the start: a death test may be the first that needs one.
const FolderOfTheProgram folder_of_the_program;

}  // namespace

Backend& SharedBackend() {
  static Backend backend{
      BackendOptions{.cache = std::filesystem::temp_directory_path() / "kinevox-test-kernels",
                     .cpu_as_gpu = std::getenv("KVX_CPU_AS_GPU") != nullptr}};
  return backend;
}

Grid ObliqueGrid(const Eigen::Vector3i& size) {
  Grid grid;
  grid.size = size;
  grid.spacing_mm = {0.8, 1.1, 1.4};
  grid.origin.lps = {-7.0, 12.0, 31.0};
  grid.direction = Eigen::AngleAxisd(0.4, Eigen::Vector3d(1, -2, 0.5).normalized()).toRotationMatrix();
  return grid;
}

Volume LinearRamp::On(const Grid& grid) const {
  Volume out(grid);
  for (size_t v = 0; v < out.values.size(); ++v) {
    out.values[v] = float(At(grid.ToMm(PointVox{grid.Ijk(v).cast<double>()})));
  }
  return out;
}

DisplacementField FieldOf(const RigidTransform& b_from_a, const Grid& grid) {
  DisplacementField out(grid, Eigen::Vector3f::Zero());
  for (size_t v = 0; v < out.values.size(); ++v) {
    const PointMm x = grid.ToMm(PointVox{grid.Ijk(v).cast<double>()});
    out.values[v] = ((b_from_a * x).lps - x.lps).cast<float>();
  }
  return out;
}

std::string Content(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return std::string((std::istreambuf_iterator<char>(in)), {});
}

double BetweenAxesDeg(const Eigen::Vector3d& a, const Eigen::Vector3d& b) {
  return DegFromRad(std::acos(std::min(1.0, std::abs(a.dot(b)))));
}

ScratchFolder::ScratchFolder() : path_(NewFolder(folder_of_the_program.path(), "")) {}

ScratchFolder::~ScratchFolder() {
  std::error_code ignored;
  std::filesystem::remove_all(path_, ignored);
}

size_t FilesUnder(const std::filesystem::path& folder) {
  size_t files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder))
    files += entry.is_regular_file();
  return files;
}

std::filesystem::path SharedData() {
  return std::filesystem::path(KVX_SOURCE_DIR).parent_path() / "shared/data";
}
bool HasSharedData() { return std::filesystem::exists(SharedData() / "README.md"); }

}  // namespace kvx::testing_support
