// The host side of kernels/cl/elastic_sweep.cl. A lattice goes to the device with a border of absent nodes,
// and in every row the even nodes before the odd ones: so eight nodes of a colour lie side by side in memory,
// and so do their neighbours on each side.
#include "kernels/elastic_sweeps.h"

#include <algorithm>
#include <array>

#include "core/host/parallel.h"
#include "kernels/device/device_buffer.h"
#include "kernels/device/launch.h"

namespace kvx {
namespace {

constexpr int kBorder = 2;  // nodes before the first, so that parities stay; one or more behind the last
constexpr int kSegment = 8;
constexpr size_t kGroup = 16;  // segments
constexpr int kHoldPlanes = 6;
enum Edge : uint8_t { kNone = 0, kThroughAir = 1, kThroughTissue = 2 };  // as the kernel reads them

int RoundedUp(int n, int to) { return (n + to - 1) / to * to; }

struct Layout {
  explicit Layout(const Eigen::Vector3i& nodes)
      : size(nodes),
        half(RoundedUp((nodes.x() + kBorder) / 2 + 1, kSegment)),
        rows(RoundedUp(nodes.y() + kBorder + 1, 2)),
        slices(RoundedUp(nodes.z() + kBorder + 1, 2)),
        plane(size_t(2 * half) * size_t(rows) * size_t(slices) + kSegment) {}

  // Of the first node of a row (even), and of the second (odd).
  size_t RowAt(int j, int k, int odd) const {
    const size_t row = size_t(k + kBorder) * size_t(rows) + size_t(j + kBorder);
    return (2 * row + size_t(odd)) * size_t(half) + kBorder / 2;
  }
  size_t At(const Eigen::Vector3i& node) const {
    return RowAt(node.y(), node.z(), node.x() & 1) + size_t(node.x() / 2);
  }
  // Calls visit(n, at, node) for every node of the lattice: its index there, its place here.
  template <class Visit>
  void ForEach(Visit visit) const {
    ParallelEach(size_t(size.y()) * size_t(size.z()), [&](size_t row) {
      const int j = int(row % size_t(size.y())), k = int(row / size_t(size.y()));
      const std::array<size_t, 2> at{RowAt(j, k, 0), RowAt(j, k, 1)};
      for (int i = 0; i < size.x(); ++i)
        visit(row * size_t(size.x()) + size_t(i), at[i & 1] + size_t(i / 2), Eigen::Vector3i(i, j, k));
    });
  }
  Eigen::Vector3i size;
  int half, rows, slices;  // half: values per half a row
  size_t plane;            // of one component; kernels read a segment beyond the last node
};

void PutPlanes(const Layout& layout, std::span<const Eigen::Vector3f> vectors, std::span<float> out) {
  layout.ForEach([&](size_t n, size_t at, const Eigen::Vector3i&) {
    for (int a = 0; a < 3; ++a) out[size_t(a) * layout.plane + at] = vectors[n][a];
  });
}

std::vector<float> Planes(const Layout& layout, std::span<const Eigen::Vector3f> vectors) {
  std::vector<float> out(3 * layout.plane, 0.0f);
  PutPlanes(layout, vectors, out);
  return out;
}

// A plane per axis: of what the edge from every node to the next is.
std::vector<uint8_t> Edges(const Layout& layout, const ElasticLattice& lattice) {
  std::vector<uint8_t> out(3 * layout.plane, kNone);
  const std::array<size_t, 3> strides{1, size_t(layout.size.x()), size_t(layout.size.x()) * layout.size.y()};
  layout.ForEach([&](size_t n, size_t at, const Eigen::Vector3i& node) {
    if (lattice.kinds[n] == NodeKind::kAbsent) return;
    for (int a = 0; a < 3; ++a) {
      if (node[a] + 1 >= layout.size[a] || lattice.kinds[n + strides[a]] == NodeKind::kAbsent) continue;
      out[size_t(a) * layout.plane + at] = lattice.joined[n] >> a & 1 ? kThroughTissue : kThroughAir;
    }
  });
  return out;
}

std::vector<float> Stiffness(const Layout& layout, const ElasticLattice& lattice) {
  if (lattice.stiffness.empty()) return {};
  std::vector<float> out(layout.plane, 1.0f);
  layout.ForEach([&](size_t n, size_t at, const Eigen::Vector3i&) { out[at] = lattice.stiffness[n]; });
  return out;
}

// Planes xx xy xz yy yz zz: per node in the layout's order, or per cell of two nodes each way, cells in rows
// of half a row's length.
size_t HoldPlane(const Layout& layout, const ElasticLattice& lattice) {
  if (lattice.holds.empty()) return 0;
  return lattice.hold_nodes == 1 ? layout.plane : layout.plane / 8 + kSegment;
}
std::vector<float> Holds(const Layout& layout, const ElasticLattice& lattice) {
  const size_t plane = HoldPlane(layout, lattice);
  if (plane == 0) return {};
  constexpr int kRow[kHoldPlanes] = {0, 0, 0, 1, 1, 2}, kColumn[kHoldPlanes] = {0, 1, 2, 1, 2, 2};
  std::vector<float> out(kHoldPlanes * plane, 0.0f);
  const auto put = [&](const Eigen::Matrix3f& hold, size_t at) {
    for (int c = 0; c < kHoldPlanes; ++c) out[size_t(c) * plane + at] = hold(kRow[c], kColumn[c]);
  };
  if (lattice.hold_nodes == 1) {
    layout.ForEach([&](size_t n, size_t at, const Eigen::Vector3i&) { put(lattice.holds[n], at); });
    return out;
  }
  const Eigen::Vector3i cells = lattice.size / 2;
  ParallelEach(size_t(cells.y()) * size_t(cells.z()), [&](size_t row) {
    const size_t j = row % size_t(cells.y()) + kBorder / 2, k = row / size_t(cells.y()) + kBorder / 2;
    const size_t at = (k * size_t(layout.rows / 2) + j) * size_t(layout.half) + kBorder / 2;
    for (int i = 0; i < cells.x(); ++i)
      put(lattice.holds[row * size_t(cells.x()) + size_t(i)], at + size_t(i));
  });
  return out;
}

// By colour: where the segments begin in which a node moves.
std::array<std::vector<cl_int>, 8> Segments(const Layout& layout, const std::vector<uint8_t>& moves) {
  std::array<std::vector<cl_int>, 8> out;
  for (int colour = 0; colour < 8; ++colour) {
    for (int k = colour >> 2; k < layout.size.z(); k += 2) {
      for (int j = colour >> 1 & 1; j < layout.size.y(); j += 2) {
        const size_t first = layout.RowAt(j, k, colour & 1) - kBorder / 2;
        for (size_t at = first; at < first + size_t(layout.half); at += kSegment) {
          const auto begin = moves.begin() + std::ptrdiff_t(at);
          if (std::any_of(begin, begin + kSegment, [](uint8_t m) { return m != 0; }))
            out[size_t(colour)].push_back(cl_int(at));
        }
      }
    }
  }
  return out;
}

void TakeBack(const Layout& layout, std::span<const float> planes, ElasticLattice& lattice) {
  layout.ForEach([&](size_t n, size_t at, const Eigen::Vector3i&) {
    for (int a = 0; a < 3; ++a) lattice.positions_mm[n][a] = planes[size_t(a) * layout.plane + at];
  });
}

cl_float4 PerMm(const ElasticLattice& lattice) {
  const Eigen::Vector3f stretch = lattice.rest_spacing_mm.cwiseInverse().cast<float>();
  const float hand = lattice.handedness < 0 ? -1 : 1;
  return {{stretch.x(), stretch.y(), hand * stretch.z(), kElasticOverRelaxation}};
}

// Of the nodes of a colour, how far the nodes before and after along x lie, and a row and a slice.
cl_int4 Beside(const Layout& layout, size_t colour) {
  const cl_int row = 2 * layout.half, slice = row * layout.rows;
  if (colour & 1) return {{-layout.half, 1 - layout.half, row, slice}};
  return {{layout.half - 1, layout.half, row, slice}};
}

}  // namespace

struct PreparedLattice {
  PreparedLattice(const ElasticLattice& lattice, std::vector<uint8_t> which)
      : layout(lattice.size),
        moves(std::move(which)),
        edges(Edges(layout, lattice)),
        stiffness(Stiffness(layout, lattice)),
        segments(Segments(layout, moves)) {}

  Layout layout;
  std::vector<uint8_t> moves, edges;
  std::vector<float> stiffness;
  std::array<std::vector<cl_int>, 8> segments;
};

ElasticSweeps::ElasticSweeps(Backend& backend)
    : backend_(backend), program_(backend.programs().Build("elastic_sweep.cl")) {}

std::shared_ptr<const PreparedLattice> ElasticSweeps::Prepare(const ElasticLattice& lattice) const {
  const Layout layout(lattice.size);
  std::vector<uint8_t> moves(layout.plane, 0);
  layout.ForEach(
      [&](size_t n, size_t at, const Eigen::Vector3i&) { moves[at] = lattice.kinds[n] == NodeKind::kFree; });
  return std::make_shared<const PreparedLattice>(lattice, std::move(moves));
}

void ElasticSweeps::operator()(ElasticLattice& lattice, int sweeps) const {
  (*this)(*Prepare(lattice), lattice, sweeps);
}

void ElasticSweeps::operator()(ElasticLattice& lattice, int sweeps, std::span<const uint32_t> nodes) const {
  const Layout layout(lattice.size);
  std::vector<uint8_t> moves(layout.plane, 0);
  for (const uint32_t n : nodes)
    if (lattice.kinds[n] == NodeKind::kFree) moves[layout.At(lattice.NodeAt(n))] = 1;
  (*this)(PreparedLattice(lattice, std::move(moves)), lattice, sweeps);
}

void ElasticSweeps::operator()(const PreparedLattice& prepared, ElasticLattice& lattice, int sweeps) const {
  const auto& [layout, moves, edges, stiffness, segments] = prepared;
  const std::vector<float> holds = Holds(layout, lattice);
  const std::vector<float> held_mm = holds.empty() ? holds : Planes(layout, lattice.held_mm);
  const auto there = [&]<class T>(const std::vector<T>& values) {
    return DeviceBuffer<T>::Shared(backend_, std::span(values));
  };
  const auto moves_there = there(moves), edges_there = there(edges);
  const auto stiffness_there = there(stiffness), holds_there = there(holds), held_there = there(held_mm);
  DeviceBuffer<float> positions(backend_, 3 * layout.plane);
  positions.UploadFrom(backend_.queue(),
                       [&](std::span<float> planes) { PutPlanes(layout, lattice.positions_mm, planes); });
  const cl_float4 tissue{
      {lattice.volume_stiffness, lattice.air_stiffness, stiffness.empty() ? 0.0f : 1.0f, 0}};
  const cl_int4 hold{{cl_int(HoldPlane(layout, lattice)), lattice.hold_nodes, layout.half, layout.rows}};
  const DeviceBuffer<cl_int> stirred(backend_, std::vector<cl_int>(layout.plane / kSegment, 0));
  std::vector<cl::Kernel> colours;
  std::vector<DeviceBuffer<cl_int>> lists;
  cl_uint sweep_argument = 0;
  for (size_t c = 0; c < segments.size(); ++c) {
    lists.push_back(there(segments[c]));
    colours.emplace_back(program_, "elastic_sweep");
    sweep_argument = SetArgs(colours[c], lists[c].buffer(), cl_int(segments[c].size()), cl_int(layout.plane),
                             Beside(layout, c), PerMm(lattice), tissue, moves_there.buffer(),
                             edges_there.buffer(), stiffness_there.buffer(), hold, holds_there.buffer(),
                             held_there.buffer(), positions.buffer(), lattice.still_mm, stirred.buffer());
  }
  for (cl_int sweep = 1; sweep <= sweeps; ++sweep) {
    for (size_t c = 0; c < segments.size(); ++c) {
      if (segments[c].empty()) continue;
      colours[c].setArg(sweep_argument, sweep);
      Enqueue(backend_.queue(), colours[c], segments[c].size(), kGroup);
    }
  }
  positions.DownloadTo(backend_.queue(),
                       [&](std::span<const float> planes) { TakeBack(layout, planes, lattice); });
}

}  // namespace kvx
