// Elastic lattices on the device: nodes move to where the energy around them is least, colour by colour.
#pragma once
#include <memory>

#include "kernels/device/backend.h"
#include "kernels/elastic_lattice.h"

namespace kvx {

struct PreparedLattice;  // what stays as it is from one call to the next

class ElasticSweeps {
 public:
  explicit ElasticSweeps(Backend& backend);

  // `sweeps` over all free nodes, in place.
  void operator()(ElasticLattice& lattice, int sweeps) const;
  // The same, of a lattice whose kinds, edges and stiffness are those that were prepared.
  void operator()(const PreparedLattice& prepared, ElasticLattice& lattice, int sweeps) const;
  std::shared_ptr<const PreparedLattice> Prepare(const ElasticLattice& lattice) const;
  // Over the free ones among `nodes`.
  void operator()(ElasticLattice& lattice, int sweeps, std::span<const uint32_t> nodes) const;

 private:
  Backend& backend_;
  cl::Program program_;
};

}  // namespace kvx
