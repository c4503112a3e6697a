// Where a posed body would share space with another part of itself.
#pragma once
#include <optional>

#include "pipeline/phantom/motion/elastic_solid.h"
#include "pipeline/phantom/motion/tet_locator.h"

namespace kvx::phantom {

constexpr double kFarCells = 2.5;  // at rest, between parts that can meet

class SelfContact {
 public:
  // `skin`: signed distance of the rest body, < 0 inside. Keeps a reference to the mesh.
  SelfContact(const TetMesh& mesh, std::function<double(const Eigen::Vector3d&)> skin);

  // Of every point of the skin, and every node close below it, that lies in another part of the body or just
  // outside it.
  std::vector<SolidContact> Find(const std::vector<Eigen::Vector3d>& posed_nodes) const;

 private:
  struct Sample {  // a material point of the body; its weights add up to 1
    std::array<int, 2> nodes{};
    std::array<double, 2> weights{1, 0};
    Eigen::Vector3d rest;
  };
  void AddSamples();
  std::optional<SolidContact> ContactOf(const Sample& sample, const std::vector<Eigen::Vector3d>& posed_nodes,
                                        const TetLocator& locator) const;
  Eigen::Vector3d PosedSkinSlope(const Eigen::Vector3d& rest,
                                 const std::vector<Eigen::Vector3d>& posed_nodes) const;

  const TetMesh& mesh_;
  std::function<double(const Eigen::Vector3d&)> skin_;
  std::vector<Sample> samples_;
};

// How deep the deepest of them lies where it was found; 0 where none overlaps.
double OverlapMm(std::span<const SolidContact> contacts);

}  // namespace kvx::phantom
