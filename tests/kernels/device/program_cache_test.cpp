// What a device's compiler has to say of our kernels ends up on users' screens.
#include "kernels/device/program_cache.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <filesystem>
#include <sstream>

#include "core/errors.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {
using namespace testing_support;

// In its log, and on stderr, where NVIDIA's counts what it keeps out of the log.
std::string SaidOf(const std::string& file) {
  const cl::Device& device = SharedBackend().device();
  cl::Program program(SharedBackend().context(), EmbeddedSource(file));
  testing::internal::CaptureStderr();
  program.build(device, "-cl-std=CL1.2");
  return program.getBuildInfo<CL_PROGRAM_BUILD_LOG>(device) + "\n" + testing::internal::GetCapturedStderr();
}

bool IsBlank(const std::string& text) {
  return std::ranges::all_of(text, [](unsigned char c) { return c == 0 || std::isspace(c); });
}

// NVIDIA's compiler says this of kernels to which it gave that attribute itself.
bool IsOfItsOwnMaking(const std::string& line) {
  return line.find("is a kernel, so overriding noinline attribute") != line.npos;
}

TEST(Kernels, CompileWithoutAWarning) {
  int kernels = 0;
  for (const auto& entry : std::filesystem::directory_iterator(KVX_SOURCE_DIR "/kernels/cl")) {
    const std::string file = entry.path().filename().string();
    if (!file.ends_with(".cl")) continue;
    std::istringstream said(SaidOf(file));
    for (std::string line; std::getline(said, line);)
      EXPECT_TRUE(IsBlank(line) || IsOfItsOwnMaking(line)) << file << ": " << line;
    ++kernels;
  }
  EXPECT_GT(kernels, 0);
}

class KeptPrograms : public testing::Test {
 protected:
  // How many a cache of this folder has to compile for one program.
  int Compiled() {
    ProgramCache cache(SharedBackend().context(), SharedBackend().device(), folder_.path());
    cache.Build("warp_trilinear.cl");
    return cache.compiled_count();
  }

  ScratchFolder folder_;
};

TEST_F(KeptPrograms, AreFoundAgain) {
  EXPECT_EQ(Compiled(), 1);
  EXPECT_EQ(Compiled(), 0);
}

// A binary is code.
TEST_F(KeptPrograms, AreNotLoadedWhereOthersMayHaveWrittenThem) {
  EXPECT_EQ(Compiled(), 1);
  for (const auto& entry : std::filesystem::directory_iterator(folder_.path()))
    permissions(entry.path(), std::filesystem::perms::others_write, std::filesystem::perm_options::add);
  EXPECT_EQ(Compiled(), 1);
  EXPECT_EQ(Compiled(), 0) << "replaced by its own";
}

// No byte is free there.
TEST(KernelsOfPocl, AreRefusedBeforeTheirDiskIsFullUnlessTheyWereAskedForBefore) {
  if (!IsPocls(SharedBackend().device())) GTEST_SKIP() << "not PoCL";
  ProgramCache cache(SharedBackend().context(), SharedBackend().device(), {});
  cache.Build("warp_trilinear.cl");
  const std::string before = std::getenv("POCL_CACHE_DIR");
  ::setenv("POCL_CACHE_DIR", "/proc/self", 1);
  EXPECT_NO_THROW(cache.Build("warp_trilinear.cl"));
  EXPECT_THROW(cache.Build("harmonic.cl"), Unavailable);
  EXPECT_FALSE(SharedBackend().HasRoom());
  ::setenv("POCL_CACHE_DIR", before.c_str(), 1);
  EXPECT_TRUE(SharedBackend().HasRoom());
}

TEST(KernelsWithoutAFolder, AreCompiledAndNotKept) {
  ProgramCache cache(SharedBackend().context(), SharedBackend().device(), {});
  cache.Build("warp_trilinear.cl");
  EXPECT_EQ(cache.compiled_count(), 1);
}

}  // namespace
}  // namespace kvx
