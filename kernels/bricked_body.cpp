// Node look-up and upload.
#include "kernels/bricked_body.h"

namespace kvx {

int BrickedBody::BrickOf(const Eigen::Vector3i& node) const {
  const Eigen::Vector3i b(node.x() >> 2, node.y() >> 2, node.z() >> 2);
  if ((node.array() < 0).any() || (b.array() >= bricks.array()).any()) return -1;
  return brick_at[(size_t(b.z()) * bricks.y() + b.y()) * bricks.x() + b.x()];
}

bool BrickedBody::Bit(const std::vector<uint64_t>& bits, const Eigen::Vector3i& node) const {
  const int brick = BrickOf(node);
  return brick >= 0 && ((bits[brick] >> Slot(node)) & 1);
}

DeviceBody::DeviceBody(Backend& backend, const BrickedBody& b)
    : brick_at(backend, b.brick_at),
      first_nodes(backend, b.first_nodes),
      body(backend, b.body),
      carried(backend, b.carried),
      closed(backend, b.closed),
      bones(backend, b.bones),
      weights(backend, b.weights),
      examples(backend, b.examples),
      bricks{{b.bricks.x(), b.bricks.y(), b.bricks.z(), b.cell_bricks}},
      stored(b.stored()),
      example_count(b.example_count) {}

}  // namespace kvx
