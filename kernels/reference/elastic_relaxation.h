// CPU twin of kernels/elastic_sweeps.h. Where a few nodes move at a time it is the quicker of the two, and
// used.
#pragma once
#include "kernels/elastic_lattice.h"

namespace kvx::reference {

void Relax(ElasticLattice& lattice, int sweeps);
// Only the free ones among `nodes` move.
void Relax(ElasticLattice& lattice, int sweeps, std::span<const uint32_t> nodes);

double ElasticEnergy(const ElasticLattice& lattice);

}  // namespace kvx::reference
