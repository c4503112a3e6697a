// How much the tissue near a bone moves with every joint, learned from the examples themselves.
#pragma once
#include "core/skeleton.h"

namespace kvx {

// Poses as rows of joint angles.
using PoseRows = Eigen::MatrixXd;

// Joints whose angles bend the tissue near a bone, as far as nothing has been learned: its own, those that
// drive it, and its children's.
std::vector<int> NeighbouringJoints(const Skeleton& skeleton, int bone);

// What pairs of poses have in common, two matrices (poses_a x poses_b) for every joint that turns: the
// covariance of a displacement that grows linearly with its angles, and of one that wanders as it turns
// (Brownian motion). All are 0 where either pose is the template's.
std::vector<Eigen::MatrixXd> SharedMotion(const Skeleton& skeleton, const PoseRows& poses_a,
                                          const PoseRows& poses_b);

// Of the displacements near one bone, relative to their mean square in the examples.
struct Variances {
  Eigen::VectorXd shared;  // one factor for each matrix of SharedMotion
  double own = 0;          // of what belongs to one scan alone (its noise), before ...
  Eigen::VectorXd share;   // ... each scan's share in it
};

// What is assumed before the examples are looked at: `near` joints move the tissue, others hardly.
Variances AssumedVariances(const std::vector<Eigen::MatrixXd>& shared, const std::vector<bool>& near,
                           Eigen::Index scans);

// The most likely variances, given the second moments near the bone (ExampleMoments) of those `scans` that
// show it. Moments of no size teach nothing.
Variances LearnVariances(const std::vector<Eigen::MatrixXd>& shared, const Eigen::MatrixXd& moments,
                         const std::vector<int>& scans, Variances assumed);

}  // namespace kvx
