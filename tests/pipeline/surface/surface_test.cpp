// Surfaces against spheres and ellipsoids, whose volume, area and normals are known; files read back.
#include <gtest/gtest.h>
#include <tiny_gltf.h>

#include <algorithm>
#include <cstring>
#include <numbers>
#include <vector>

#include "core/errors.h"
#include "pipeline/io/surface_file.h"
#include "pipeline/surface/level_surface.h"
#include "pipeline/surface/mask_surface.h"
#include "pipeline/surface/simplified_mesh.h"
#include "tests/support/fixtures.h"

namespace kvx {
namespace {

using testing_support::ObliqueGrid;
constexpr double kPi = std::numbers::pi;

PointMm Middle(const Grid& grid) { return grid.ToMm(PointVox{(grid.size.cast<double>().array() - 1) / 2}); }

Volume SphereDistance(const Grid& grid, double radius_mm) {
  Volume out(grid);
  for (size_t v = 0; v < out.values.size(); ++v)
    out.values[v] =
        float(radius_mm - (grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps - Middle(grid).lps).norm());
  return out;
}

Grid FineGrid(bool left_handed = false) {
  Grid grid = ObliqueGrid({40, 38, 44});
  grid.spacing_mm = {0.8, 1.0, 0.7};
  if (left_handed) grid.direction.col(2) *= -1;
  return grid;
}

TEST(LevelSurface, ASphereHasItsVolumeAreaAndNormals) {
  for (const bool left_handed : {false, true}) {
    const Grid grid = FineGrid(left_handed);
    const double r = 11;
    const TriangleMesh mesh = LevelSurface(SphereDistance(grid, r));
    EXPECT_TRUE(IsClosed(mesh));
    EXPECT_NEAR(EnclosedVolumeMm3(mesh) / (4.0 / 3 * kPi * r * r * r), 1, 0.01);
    EXPECT_NEAR(AreaMm2(mesh) / (4 * kPi * r * r), 1, 0.02);
    const std::vector<Eigen::Vector3f> normals = VertexNormals(mesh);
    double worst = 1, sum = 0, farthest = 0;
    for (size_t v = 0; v < normals.size(); ++v) {
      const Eigen::Vector3d out = mesh.vertices_mm[v].cast<double>() - Middle(grid).lps;
      const double along = normals[v].cast<double>().dot(out.normalized());
      worst = std::min(worst, along), sum += along;
      farthest = std::max(farthest, std::abs(out.norm() - r));
    }
    EXPECT_LT(farthest, 0.08);
    EXPECT_GT(worst, 0.8);
    EXPECT_GT(sum / double(normals.size()), 0.98);
  }
}

TEST(LevelSurface, AnyFunctionGivesAClosedSurface) {
  Volume noise(ObliqueGrid({12, 11, 13}), -1.0f);
  uint32_t state = 7;
  for (int k = 1; k < 12; ++k) {
    for (int j = 1; j < 10; ++j) {
      for (int i = 1; i < 11; ++i) {
        state = state * 1664525u + 1013904223u;
        noise(i, j, k) = float(state >> 8) / float(1 << 23) - 1.0f;
      }
    }
  }
  const TriangleMesh mesh = LevelSurface(noise);
  EXPECT_GT(mesh.triangles.size(), 1000u);
  EXPECT_TRUE(IsClosed(mesh));
  EXPECT_GT(EnclosedVolumeMm3(mesh), 0);
}

// Of a sphere every place of a triangle is known to lie as far off as its distance from the middle says.
TEST(SimplifiedMesh, NoPlaceLiesMoreThanTwiceAsFarOffAsWasAllowed) {
  const Grid grid = FineGrid();
  const double radius_mm = 11;
  const TriangleMesh full = LevelSurface(SphereDistance(grid, radius_mm));
  for (const double largest_mm : {0.1, 0.4, 1.5}) {
    const TriangleMesh mesh = SimplifiedMesh(full, largest_mm);
    EXPECT_LT(mesh.triangles.size(), full.triangles.size() / 4);
    double farthest_mm = 0;
    for (const auto& [a, b, c] : mesh.triangles) {
      const Eigen::Vector3f corner = mesh.vertices_mm[a],
                            middle = (corner + mesh.vertices_mm[b] + mesh.vertices_mm[c]) / 3;
      for (const Eigen::Vector3f& x : {corner, middle})
        farthest_mm =
            std::max(farthest_mm, std::abs((x.cast<double>() - Middle(grid).lps).norm() - radius_mm));
    }
    EXPECT_LT(farthest_mm, 2 * largest_mm);
    EXPECT_GT(farthest_mm, largest_mm / 4) << "more triangles than are needed";
  }
}

TEST(LevelSurface, NothingInsideIsNoSurface) {
  EXPECT_TRUE(LevelSurface(Volume(ObliqueGrid(), -1.0f)).triangles.empty());
}

TEST(MaskSurface, AnEllipsoidOfVoxelsComesOutSmoothAndWhole) {
  const Grid grid = FineGrid();
  const Eigen::Vector3d half(12, 8, 10);
  Mask mask(grid);
  for (size_t v = 0; v < mask.values.size(); ++v) {
    const Eigen::Vector3d x =
        grid.direction.transpose() * (grid.ToMm(PointVox{grid.Ijk(v).cast<double>()}).lps - Middle(grid).lps);
    mask.values[v] = x.cwiseQuotient(half).norm() <= 1;
  }
  const TriangleMesh full = MaskSurface(mask, {.largest_error_vox = 0}), mesh = MaskSurface(mask);
  EXPECT_TRUE(IsClosed(full));
  EXPECT_TRUE(IsClosed(mesh));
  EXPECT_LT(mesh.triangles.size(), full.triangles.size() / 2);
  EXPECT_NEAR(EnclosedVolumeMm3(mesh) / (4.0 / 3 * kPi * half.prod()), 1, 0.03);
  double farthest = 0;
  for (const Eigen::Vector3f& vertex : mesh.vertices_mm) {
    const Eigen::Vector3d x = grid.direction.transpose() * (vertex.cast<double>() - Middle(grid).lps);
    farthest = std::max(farthest, std::abs(x.cwiseQuotient(half).norm() - 1) * half.minCoeff());
  }
  EXPECT_LT(farthest, 0.5) << "mm from the ellipsoid";
}

// Thinner than the smoothing reaches: a voxel, a row, a plate of one slice.
TEST(MaskSurface, SmallAndThinBonesKeepASurface) {
  Grid grid = ObliqueGrid({30, 30, 30});
  grid.spacing_mm = {0.5, 0.5, 4};
  for (const Eigen::Vector3i& size :
       {Eigen::Vector3i(1, 1, 1), Eigen::Vector3i(2, 2, 2), Eigen::Vector3i(1, 1, 20),
        Eigen::Vector3i(10, 10, 1), Eigen::Vector3i(20, 20, 1)}) {
    Mask mask(grid);
    for (size_t v = 0; v < mask.values.size(); ++v) {
      const Eigen::Vector3i at = grid.Ijk(v).array() - 5;
      mask.values[v] = (at.array() >= 0).all() && (at.array() < size.array()).all();
    }
    const TriangleMesh mesh = MaskSurface(mask);
    EXPECT_TRUE(IsClosed(mesh)) << size.transpose();
    const double share = EnclosedVolumeMm3(mesh) / (size.prod() * grid.spacing_mm.prod());
    EXPECT_GT(share, 0.8) << size.transpose();
    EXPECT_LT(share, 1.2) << size.transpose();
  }
}

Mask Block(const Grid& grid, const Eigen::Vector3i& size) {
  Mask block(grid);
  for (size_t v = 0; v < block.values.size(); ++v) {
    const Eigen::Vector3i at = grid.Ijk(v).array() - 4;
    block.values[v] = (at.array() >= 0).all() && (at.array() < size.array()).all();
  }
  return block;
}

Mask BallOfVoxels(const Grid& grid, double radius_vox) {
  Mask ball(grid);
  for (size_t v = 0; v < ball.values.size(); ++v) {
    const Eigen::Vector3d at = grid.Ijk(v).cast<double>() - 0.5 * (grid.size.cast<double>());
    ball.values[v] = at.norm() <= radius_vox;
  }
  return ball;
}

// The least finger bone of a scan is a few dozen voxels; what is round loses most to smoothing.
TEST(MaskSurface, EnclosesTheVoxelsVolumeHoweverSmallAndSmooth) {
  for (const Eigen::Vector3d& spacing_mm : {Eigen::Vector3d(1, 1, 1), Eigen::Vector3d(0.8, 1, 0.7)}) {
    Grid grid = ObliqueGrid({22, 22, 22});
    grid.spacing_mm = spacing_mm;
    std::vector<Mask> sets;
    for (const double radius_vox : {1.5, 2.5, 4.0, 8.0}) sets.push_back(BallOfVoxels(grid, radius_vox));
    for (const Eigen::Vector3i& size : {Eigen::Vector3i(2, 2, 2), Eigen::Vector3i(3, 4, 5),
                                        Eigen::Vector3i(2, 3, 12), Eigen::Vector3i(10, 12, 8)})
      sets.push_back(Block(grid, size));
    for (const Mask& set : sets) {
      const auto voxels = std::ranges::count(set.values, uint8_t(1));
      for (const double smoothing_vox : {0.0, 0.5, 1.0, 2.0}) {
        const TriangleMesh full = MaskSurface(set, {.smoothing_vox = smoothing_vox, .largest_error_vox = 0}),
                           mesh = MaskSurface(set, {.smoothing_vox = smoothing_vox});
        const double mm3 = double(voxels) * grid.spacing_mm.prod();
        EXPECT_TRUE(IsClosed(full) && IsClosed(mesh)) << voxels << " voxels, smoothing " << smoothing_vox;
        EXPECT_NEAR(EnclosedVolumeMm3(full) / mm3, 1, 0.02)
            << voxels << " voxels, smoothing " << smoothing_vox;
        EXPECT_NEAR(EnclosedVolumeMm3(mesh) / mm3, 1, 0.05)
            << voxels << " voxels, smoothing " << smoothing_vox;
      }
    }
  }
}

TEST(MaskSurface, AThinFoldDoesNotCostTheRestItsSimplicity) {
  // Two plates with a web of one voxel's thickness between them: collapsed, its sides meet
  const Grid grid = ObliqueGrid({60, 40, 24});
  Mask mask(grid);
  uint32_t state = 5;
  for (size_t v = 0; v < mask.values.size(); ++v) {
    const Eigen::Vector3i at = grid.Ijk(v);
    state = state * 1664525u + 1013904223u;
    const bool crumb = (state >> 24) < 60 && at.x() > 50;
    const bool plate = (at.z() >= 4 && at.z() < 10) || (at.z() >= 13 && at.z() < 20);
    mask.values[v] = at.minCoeff() >= 3 && at.x() < 56 && at.y() < 36 && at.z() < 20 &&
                     (at.x() > 50 ? crumb : plate || at.y() == 20);
  }
  const TriangleMesh full = MaskSurface(mask, {.smoothing_vox = 0.4, .largest_error_vox = 0});
  const TriangleMesh mesh = MaskSurface(mask, {.smoothing_vox = 0.4});
  EXPECT_TRUE(IsClosed(full));
  EXPECT_TRUE(IsClosed(mesh));
  EXPECT_LT(mesh.triangles.size(), full.triangles.size() / 2);
  EXPECT_NEAR(EnclosedVolumeMm3(mesh) / EnclosedVolumeMm3(full), 1, 0.01);
}

TEST(LargePieces, CrumbsAndCavitiesGo) {
  const Grid grid = ObliqueGrid({20, 20, 30});
  Mask block(grid);
  for (size_t v = 0; v < block.values.size(); ++v) {
    const Eigen::Vector3i at = grid.Ijk(v);
    block.values[v] = (at.array() >= 3).all() && at.x() < 17 && at.y() < 17 && at.z() < 17;
  }
  Mask more = block;
  more(10, 10, 24) = 1;
  for (const int i : {9, 10}) more(i, 10, 10) = 0;
  const SurfaceOptions plain{.smoothing_vox = 0, .largest_error_vox = 0};
  const TriangleMesh alone = MaskSurface(block, plain), all = MaskSurface(more, plain);
  const TriangleMesh large = LargePieces(all, 0.01);
  EXPECT_GT(all.triangles.size(), large.triangles.size());
  EXPECT_TRUE(IsClosed(large));
  EXPECT_EQ(large.triangles.size(), alone.triangles.size());
  EXPECT_NEAR(EnclosedVolumeMm3(large), EnclosedVolumeMm3(alone), 0.01 * EnclosedVolumeMm3(alone));
  EXPECT_EQ(LargePieces(all, -1).triangles.size(), all.triangles.size()) << "no piece is too small";
}

TEST(MaskSurface, IsClosedAtTheGridsEdge) {
  const Grid grid = ObliqueGrid({9, 8, 7});
  const TriangleMesh mesh = MaskSurface(Mask(grid, 1));
  EXPECT_TRUE(IsClosed(mesh));
  EXPECT_NEAR(EnclosedVolumeMm3(mesh) / (double(grid.VoxelCount()) * grid.spacing_mm.prod()), 1, 0.25)
      << "edges are rounded";
  EXPECT_TRUE(MaskSurface(Mask(grid, 0)).triangles.empty());
}

TriangleMesh Tetrahedron() {
  return {{{0, 0, 0}, {10, 0, 0}, {0, 20, 0}, {0, 0, 30}}, {{0, 2, 1}, {0, 1, 3}, {1, 2, 3}, {0, 3, 2}}};
}

std::vector<NamedSurface> TwoSurfaces() {
  const RigidTransform moved = RotationAbout({{1, 2, 3}}, {1, 2, 2}, 0.7);
  return {{"femur", Tetrahedron(), moved.Matrix(), false},
          {"skin", Tetrahedron(), Eigen::Matrix4d::Identity(), true}};
}

TEST(SurfaceFile, GlbHasANodePerSurfaceThatCarriesItsMotion) {
  const std::vector<NamedSurface> surfaces = TwoSurfaces();
  const std::string bytes = GlbBytes(surfaces);
  ASSERT_EQ(bytes.substr(0, 4), "glTF");
  uint32_t length = 0;
  std::memcpy(&length, bytes.data() + 8, 4);
  EXPECT_EQ(length, bytes.size());
  tinygltf::Model model;
  std::string error, warning;
  ASSERT_TRUE(tinygltf::TinyGLTF().LoadBinaryFromMemory(
      &model, &error, &warning, reinterpret_cast<const unsigned char*>(bytes.data()), unsigned(bytes.size())))
      << error;
  ASSERT_EQ(model.nodes.size(), 3u);
  EXPECT_EQ(model.nodes[0].children.size(), 2u);
  for (size_t s = 0; s < 2; ++s) {
    const tinygltf::Node& node = model.nodes[s + 1];
    EXPECT_EQ(node.name, surfaces[s].name);
    Eigen::Matrix4d matrix = Eigen::Matrix4d::Identity();
    if (!node.matrix.empty()) matrix = Eigen::Map<const Eigen::Matrix4d>(node.matrix.data());
    EXPECT_TRUE(matrix.isApprox(surfaces[s].scan_from_mesh, 1e-12)) << "glTF's matrices are column-major";
    const auto& primitive = model.meshes[size_t(node.mesh)].primitives[0];
    const auto& positions = model.accessors[size_t(primitive.attributes.at("POSITION"))];
    EXPECT_EQ(positions.count, 4u);
    EXPECT_EQ(positions.maxValues, (std::vector<double>{10, 20, 30}));
    EXPECT_EQ(model.accessors[size_t(primitive.indices)].count, 12u);
    EXPECT_EQ(model.accessors[size_t(primitive.attributes.at("NORMAL"))].count, 4u);
  }
  const Eigen::Map<const Eigen::Matrix4d> root(model.nodes[0].matrix.data());
  EXPECT_TRUE((root * Eigen::Vector4d(0, 0, 1000, 1)).isApprox(Eigen::Vector4d(0, 1, 0, 1)))
      << "superior is up";
  EXPECT_GT((root.topLeftCorner<3, 3>().determinant()), 0) << "not mirrored";
}

TEST(SurfaceFile, StlHoldsMovedTriangles) {
  const std::vector<NamedSurface> surfaces = TwoSurfaces();
  const std::string bytes = StlBytes(surfaces);
  uint32_t count = 0;
  std::memcpy(&count, bytes.data() + 80, 4);
  ASSERT_EQ(count, 8u);
  ASSERT_EQ(bytes.size(), 84 + 50 * 8u);
  float first[12];
  std::memcpy(first, bytes.data() + 84, sizeof first);
  const Eigen::Vector4d corner = surfaces[0].scan_from_mesh * Eigen::Vector4d(0, 0, 0, 1);
  EXPECT_TRUE(Eigen::Vector3f(first + 3).isApprox(corner.head<3>().cast<float>(), 1e-5f));
  const Eigen::Vector3d normal = surfaces[0].scan_from_mesh.topLeftCorner<3, 3>() * Eigen::Vector3d(0, 0, -1);
  EXPECT_TRUE(Eigen::Vector3f(first).isApprox(normal.cast<float>(), 1e-5f)) << "outwards";
}

TEST(SurfaceFile, RefusesOtherExtensionsInWords) {
  EXPECT_THROW(WriteSurfaces("x.obj", TwoSurfaces()), InputError);
  EXPECT_THROW(GlbBytes({}), InputError);
}

}  // namespace
}  // namespace kvx
