// Elastic lattices on the device: nodes move to where the energy around them is least, colour by colour.
#pragma once
#include "kernels/backend.h"
#include "kernels/elastic_lattice.h"

namespace kvx {

class ElasticSweeps {
 public:
  explicit ElasticSweeps(Backend& backend);

  // `sweeps` over all free nodes, in place.
  void operator()(ElasticLattice& lattice, int sweeps) const;
  // Over the free ones among `nodes`.
  void operator()(ElasticLattice& lattice, int sweeps, std::span<const uint32_t> nodes) const;

 private:
  void Sweep(ElasticLattice& lattice, int sweeps, const std::vector<uint8_t>& moves) const;

  Backend& backend_;
  cl::Program program_;
};

}  // namespace kvx
