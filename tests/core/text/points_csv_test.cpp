// Points files: three numbers, everything else carried through.
#include "core/text/points_csv.h"

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
  table.points = {{Eigen::Vector3d(1.0 / 3, -1e-17, 123456.789123456789)}};
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

TEST(PointsCsv, APointBeyondAllMeasureIsRefused) {
  EXPECT_EQ(ParsePoints("x,y,z\n1e6,-1e6,0\n").points.size(), 1u);
  EXPECT_THAT([] { ParsePoints("x,y,z\n1,2,3\n1.7e308,-1.7e308,0\n"); },
              ThrowsMessage<InputError>(testing::AllOf(HasSubstr("line 3:"), HasSubstr("kilometre"))));
}

// RFC 4180: a quote opens a field only where the field begins.
TEST(PointsCsv, AQuoteInsideAFieldIsAnInchMark) {
  const std::string csv = "x,y,z,note\n10,-60,0,5\" long\n11,-61,0,x\n12,-61,0,x\n";
  const PointTable table = ParsePoints(csv);
  ASSERT_EQ(table.points.size(), 3u);
  EXPECT_EQ(table.points[2].lps, Eigen::Vector3d(12, -61, 0));
  EXPECT_EQ(FormatPoints(table), csv);
}

TEST(PointsCsv, AQuoteThatIsNeverClosedNamesItsLine) {
  const std::string csv = "x,y,z,note\n1,2,3,\"two\nlines\"\n4,5,6,\"open\n7,8,9,x\n";
  EXPECT_THAT([&] { ParsePoints(csv); },
              ThrowsMessage<InputError>(testing::AllOf(HasSubstr("line 4:"), HasSubstr("never closed"))));
  EXPECT_THAT([] { ParsePoints("x,y,z,note\n1,2,3,\"two\nlines\"\n4,5,six\n"); },
              ThrowsMessage<InputError>(HasSubstr("line 4:")));
}

TEST(PointsCsv, TablesOfOtherLanguagesAreRead) {
  const std::string ours = "x,y,z,note\n1.5,-2.5,3,\"a, \"\"b\"\"\"\n4,5,6,c\n";
  for (const std::string csv : {"x;y;z;note\n1,5;-2,5;3;a, \"b\"\n4;5;6;c\n",
                                "sep=;\r\nX;Y;Z;note\r\n1,5;-2.5;3;\"a, \"\"b\"\"\"\r\n4;5;6;c\r\n",
                                "\"x\"\ty\tz\tnote\n\"1,5\"\t-2,5\t3,0\ta, \"b\"\n4\t5\t6\tc",
                                "x,y,z,note\r1.5,-2.5,3,\"a, \"\"b\"\"\"\r4,5,6,c\r"}) {
    EXPECT_EQ(FormatPoints(ParsePoints(csv)), ours) << csv;
  }
}

TEST(PointsCsv, DecimalCommasBetweenCommasAreTold) {
  EXPECT_THAT([] { ParsePoints("x,y,z\n1,5,2,5,3,5\n"); },
              ThrowsMessage<InputError>(HasSubstr("semicolons")));
  EXPECT_THAT([] { ParsePoints("x,y,z\n\"1,5\",2,3\n"); },
              ThrowsMessage<InputError>(HasSubstr("semicolons")));
  EXPECT_EQ(ParsePoints("x,y,z\n1,2,3,\n").points.size(), 1u);
  EXPECT_EQ(ParsePoints("x,y,z\n1,2,3,\"\"\n").points.size(), 1u) << "nothing in quotes is nothing";
}

TEST(PointsCsv, WhatIsNoPlainTextSaysHowToSaveIt) {
  const std::string wide("\xFF\xFEx\0,\0y\0,\0z\0\n\0", 14);
  EXPECT_THAT([&] { ParsePoints(wide); }, ThrowsMessage<InputError>(HasSubstr("UTF-8")));
  EXPECT_THAT([] { ParsePoints("x;y;z\n1,234,5;2;3\n"); }, ThrowsMessage<InputError>(HasSubstr("line 2")));
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
