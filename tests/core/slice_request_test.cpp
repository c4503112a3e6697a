// What is said of a plane, read alike wherever it comes in.
#include "core/slice_request.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/errors.h"

namespace kvx {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(SliceRequest, NamesReadAsTheyAreWritten) {
  for (const SliceAxis axis : {SliceAxis::kAxial, SliceAxis::kCoronal, SliceAxis::kSagittal})
    EXPECT_EQ(SliceAxisFromName(NameOf(axis)), axis);
  for (const Projection projection : {Projection::kNone, Projection::kMaximum, Projection::kMean})
    EXPECT_EQ(ProjectionFromName(NameOf(projection)), projection);
  EXPECT_THROW(SliceAxisFromName("Axial"), InputError);
  EXPECT_THROW(ProjectionFromName(""), InputError);
}

TEST(SliceRequest, APlaneIsNamedByAxisPlaceDirectionsOrProjection) {
  EXPECT_TRUE(SliceRequest{}.Empty());
  EXPECT_TRUE(SliceRequest{.level = 2}.Empty()) << "volumes have levels too";
  EXPECT_FALSE(SliceRequest{.slab_mm = 5}.Empty());
  EXPECT_FALSE(SliceRequest{.slab_mm = 5}.NamesPlane());
  EXPECT_TRUE(SliceRequest{.axis = SliceAxis::kAxial}.NamesPlane());
  EXPECT_TRUE(SliceRequest{.at_mm = 0}.NamesPlane());
  EXPECT_TRUE(SliceRequest{.projection = Projection::kMean}.NamesPlane());
  EXPECT_TRUE(SliceRequest{.oblique = ObliqueOf({0, 0, 0}, {1, 0, 0}, {0, 1, 0})}.NamesPlane());
}

TEST(SliceRequest, AVideoThatNamesNoPlaneIsSeenFromTheFront) {
  const SliceRequest view = SliceRequest{.level = 1, .slab_mm = 5}.OfVideo();
  EXPECT_EQ(view.Axis(), SliceAxis::kCoronal);
  EXPECT_EQ(view.projection, Projection::kMaximum);
  EXPECT_EQ(view.slab_mm, 5);
  EXPECT_EQ(view.level, 1);
  EXPECT_NO_THROW(view.Validate());
  EXPECT_EQ((SliceRequest{.at_mm = 3}.OfVideo().projection), Projection::kNone);
}

TEST(SliceRequest, WhatDoesNotGoTogetherIsRefused) {
  EXPECT_THAT([] { SliceRequest{.slab_mm = 5}.Validate(); },
              ThrowsMessage<InputError>(HasSubstr("'slab_mm'")));
  SliceRequest view{.oblique = ObliqueOf({0, 0, 0}, {1, 0, 0}, {0, 1, 0})};
  EXPECT_NO_THROW(view.Validate());
  view.at_mm = 3;
  EXPECT_THROW(view.Validate(), InputError);
  EXPECT_FALSE(ObliqueOf({}, {}, {}));
  EXPECT_THROW(ObliqueOf({}, {1, 0, 0}, {}), InputError);
  EXPECT_THROW(ObliqueOf({1, 2}, {1, 0, 0}, {0, 1, 0}), InputError);
  EXPECT_FALSE(WindowOf({}));
  EXPECT_THROW(WindowOf({5, 5}), InputError);
  EXPECT_THROW(WindowOf({5}), InputError);
}

}  // namespace
}  // namespace kvx
