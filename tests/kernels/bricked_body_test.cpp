// What kernels believe of a body's bricks: of lists that do not go with each other none passes.
#include "kernels/bricked_body.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>

#include "pipeline/posing/brick_body.h"
#include "tests/support/hinge_world.h"

namespace kvx {
namespace {

using Damage = std::function<void(BrickedBody&)>;

class DamagedBricks : public testing::Test {
 protected:
  DamagedBricks() : bulge_(world_.Bulge(1.5)), whole_(BrickBody(world_.Inputs({&bulge_}))) {}

  void ExpectNoticed(const std::vector<Damage>& damages) const {
    ASSERT_TRUE(whole_.IsConsistent());
    for (size_t n = 0; n < damages.size(); ++n) {
      BrickedBody body = whole_;
      damages[n](body);
      EXPECT_FALSE(body.IsConsistent()) << n;
    }
  }

  testing_support::HingeWorld world_;
  DisplacementField bulge_;
  BrickedBody whole_;
};

TEST_F(DamagedBricks, PlacesAndNumbersAreNoticed) {
  ExpectNoticed({[](BrickedBody& b) { ++b.bricks.x(); },
                 [](BrickedBody& b) { *std::ranges::max_element(b.brick_at) += 1; },
                 [](BrickedBody& b) { *std::ranges::max_element(b.brick_at) = -1; },
                 [](BrickedBody& b) { *std::ranges::max_element(b.brick_at) = -2; },
                 [](BrickedBody& b) { b.first_nodes.back().s[1] += BrickedBody::kEdge; },
                 [](BrickedBody& b) { b.cell_bricks = -1; }});
}

// A brick with cells reads the first nodes of those beside it.
TEST_F(DamagedBricks, CellsBesideWhichNoNodesAreStoredAreNoticed) {
  ASSERT_LT(whole_.cell_bricks, whole_.stored());
  ExpectNoticed({[](BrickedBody& b) {
    b.cell_bricks = b.stored();
    b.tissue.resize(b.first_nodes.size()), b.cuts.resize(b.first_nodes.size());
  }});
}

TEST_F(DamagedBricks, ListsOfAnotherLengthAreNoticed) {
  ExpectNoticed(
      {[](BrickedBody& b) { b.body.pop_back(); }, [](BrickedBody& b) { b.tissue.pop_back(); },
       [](BrickedBody& b) { b.cuts.pop_back(); }, [](BrickedBody& b) { b.palette_first.pop_back(); },
       [](BrickedBody& b) { b.palette.push_back(0); }, [](BrickedBody& b) { b.weights.pop_back(); },
       [](BrickedBody& b) { b.weight_ranges.pop_back(); },
       [](BrickedBody& b) { b.weight_ranges.push_back(0); },
       [](BrickedBody& b) { b.example_first.push_back(b.example_first.back()); },
       [](BrickedBody& b) { b.example_refs.pop_back(); }, [](BrickedBody& b) { b.examples.pop_back(); },
       [](BrickedBody& b) { b.example_ranges.pop_back(); }});
}

TEST_F(DamagedBricks, WhatPointsBeyondWhatItPointsIntoIsNoticed) {
  ASSERT_FALSE(whole_.example_refs.empty());
  ExpectNoticed({[](BrickedBody& b) { b.example_refs.front().k = b.example_count; },
                 [](BrickedBody& b) { b.example_refs.front().k = -1; },
                 [](BrickedBody& b) { b.palette_first[1] = b.palette_first.back() + 1; },
                 [](BrickedBody& b) { b.palette_first.front() = 1; },
                 [](BrickedBody& b) { ++b.example_first.back(); }});
}

}  // namespace
}  // namespace kvx
