// Points files: three numbers, everything else carried through.
#include "core/points_csv.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/errors.h"

namespace kvx {
namespace {

using testing::HasSubstr;
using testing::ThrowsMessage;

TEST(PointsCsv, FurtherColumnsAreCarriedThroughVerbatim) {
  const std::string csv = "x,y,z,name,note\n1,2,3,apex,\"a, \"\"b\"\"\nsecond line\"\n-0.5,1e-3,+4,,\n";
  PointTable table = ParsePoints(csv);
  ASSERT_EQ(table.points.size(), 2u);
  EXPECT_EQ(table.points[1].lps, Eigen::Vector3d(-0.5, 0.001, 4));
  table.points[0].lps.x() = 9;
  EXPECT_EQ(FormatPoints(table),
            "x,y,z,name,note\n9,2,3,apex,\"a, \"\"b\"\"\nsecond line\"\n-0.5,0.001,4,,\n");
}

TEST(PointsCsv, NumbersComeBackExactly) {
  PointTable table;
  table.points = {{Eigen::Vector3d(1.0 / 3, -1e-17, 123456789.123456789)}};
  table.extra = {""};
  EXPECT_EQ(ParsePoints(FormatPoints(table)).points[0].lps, table.points[0].lps);
}

TEST(PointsCsv, FilesOfSpreadsheetProgramsAreRead) {
  const PointTable table = ParsePoints("\xEF\xBB\xBFx, y ,\"z\"\r\n 1 ,2,3\r\n\r\n4,5,6");
  ASSERT_EQ(table.points.size(), 2u);
  EXPECT_EQ(table.points[0].lps, Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(table.points[1].lps, Eigen::Vector3d(4, 5, 6));
}

TEST(PointsCsv, AHeaderAloneIsNoPoints) { EXPECT_EQ(FormatPoints(ParsePoints("x,y,z,id\n")), "x,y,z,id\n"); }

TEST(PointsCsv, PointsThatAreNowhereStayWhereTheyAreInTheTable) {
  PointTable table = ParsePoints("x,y,z,id\n1,2,3,a\nnan,nan,nan,b\n4,5,6,c\n");
  ReplacePoints(table.points, [](std::vector<PointMm> points) {
    EXPECT_EQ(points.size(), 2u);
    for (PointMm& point : points) point.lps *= 2;
    return points;
  });
  EXPECT_EQ(FormatPoints(table), "x,y,z,id\n2,4,6,a\nnan,nan,nan,b\n8,10,12,c\n");
}

TEST(PointsCsv, ErrorsNameTheLine) {
  EXPECT_THAT([] { ParsePoints("x,y,z\n1,2,3\n1,two,3\n"); }, ThrowsMessage<InputError>(HasSubstr("line 3")));
  EXPECT_THAT([] { ParsePoints("x,y,z\n1,2\n"); }, ThrowsMessage<InputError>(HasSubstr("line 2")));
  EXPECT_THAT([] { ParsePoints("x,y,z\n1,2,nan\n"); }, ThrowsMessage<InputError>(HasSubstr("line 2")));
  EXPECT_THAT([] { ParsePoints("x,y,z\n1,2,inf\n"); }, ThrowsMessage<InputError>(HasSubstr("line 2")));
  EXPECT_THAT([] { ParsePoints("1,2,3\n"); }, ThrowsMessage<InputError>(HasSubstr("header")));
  EXPECT_THAT([] { ParsePoints(""); }, ThrowsMessage<InputError>(HasSubstr("header")));
}

}  // namespace
}  // namespace kvx
