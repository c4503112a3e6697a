// A small textured, noisy limb with one bone, and motions planted into it that are known everywhere.
#pragma once
#include <functional>

#include "pipeline/registration/register_scan.h"
#include "tests/support/fixtures.h"

namespace kvx::testing_support::limb {

using Motion = std::function<Eigen::Vector3d(const Eigen::Vector3d&)>;  // scan world -> template world

constexpr double kSpacing = 1.5;
const Eigen::Vector3d kCentre(36, 36, 36);

Grid LimbGrid(const Eigen::Vector3i& size = {48, 48, 48});

// A ball of soft tissue with lumps, around a bright rod of bone along z; the bone has its own pattern.
constexpr double kBodyRadius = 27, kBoneRadius = 5;
double FromAxis(const Eigen::Vector3d& x);
bool InBody(const Eigen::Vector3d& x);
bool InBone(const Eigen::Vector3d& x);

Scan Render(const Grid& grid, const Motion& template_from_scan, unsigned seed, double gain = 1,
            double bias = 0, double noise_sigma = 4);
// The bone stays where it is.
RegisteredScan Register(const Scan& template_scan, const Scan& scan,
                        const RegisterScan::Options& options = {});

Eigen::Vector3d Identity(const Eigen::Vector3d& x);
// A smooth bump off the rod that leaves the bone alone, up to 2.2 voxels.
Eigen::Vector3d Bump(const Eigen::Vector3d& x);
Eigen::Vector3d TemplateFromBumped(const Eigen::Vector3d& y);
// Wider, and begun on the rod from nothing, as tissue goes on a bone.
Eigen::Vector3d WideBump(const Eigen::Vector3d& x);
Eigen::Vector3d TemplateFromWideBump(const Eigen::Vector3d& y);

struct Errors {
  double mean_mm = 0, before_mm = 0, bone_mm = 0;
};
// Over body voxels where the planted motion is at least a voxel (or all of them when there is none).
Errors Compare(const RegisteredScan& result, const Motion& truth, double least_mm);

}  // namespace kvx::testing_support::limb
