// Examples as scattered points in the space of some joint angles: which are distinct, how far they reach, and
// shares of them.
#pragma once
#include "pipeline/examples/joint_relevance.h"

namespace kvx {

// Distinct local poses (the template's first, the others by their angles), none within 0.1 degrees (0.1 mm)
// of one before it in every angle, and what each must give: its scans in equal shares, the template nothing.
struct DistinctPoses {
  Eigen::MatrixXd centres;  // poses x `dofs`
  Eigen::MatrixXd wanted;   // poses x scans
};
DistinctPoses FindDistinctPoses(const PoseRows& scans, const std::vector<int>& dofs);

// Mean distance between two of them; one radian when the template stands alone.
double TypicalDistance(const Eigen::MatrixXd& centres);

// Distance from a point to the convex hull of the rows.
double DistanceToHull(const Eigen::MatrixXd& centres, const Eigen::RowVectorXd& at);

// Positive, the more the nearer, and 1 in sum.
Eigen::VectorXd SharesByDistance(const Eigen::MatrixXd& centres, double width, const Eigen::RowVectorXd& at);

}  // namespace kvx
