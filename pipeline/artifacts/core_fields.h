// How the paper's nouns are stored and hashed: one line per type.
#pragma once
#include "core/measures.h"
#include "core/pose.h"
#include "core/registered_scan.h"
#include "core/scan.h"
#include "core/skeleton.h"
#include "core/study.h"
#include "core/weight_map.h"
#include "pipeline/artifacts/field_bytes.h"

namespace kvx {

template <>  // four bytes and four floats, in this order
inline constexpr bool kLiesAsStored<VoxelWeights> = sizeof(VoxelWeights) == 5 * kBonesPerVoxel;

template <class A>
void Fields(A& a, PointMm& v) {
  a(v.lps);
}
template <class A>
void Fields(A& a, Digest& v) {
  a(v.bytes);
}
template <class A>
void Fields(A& a, Grid& v) {
  a(v.size, v.spacing_mm, v.origin, v.direction);
}
template <class A>
void Fields(A& a, RigidTransform& v) {
  a(v.rotation, v.translation_mm);
}
// Throws Unavailable unless the grid has so many voxels.
void RequireVoxels(const Grid& grid, size_t count);

template <class A, class T>
void Fields(A& a, Image<T>& v) {
  a(v.grid, v.values);
  if constexpr (A::kReads) RequireVoxels(v.grid, v.values.size());
}
template <class A>
void Fields(A& a, Scan& v) {
  a(v.volume, v.stored_as, v.modality);
  a.AtTheEnd(v.evened_slices);  // of version 2 of the stage
  a.AtTheEnd(v.denied_ct);      // of version 4
}
template <class A>
void Fields(A& a, OrientedBox& v) {
  a(v.origin, v.axes, v.extent_mm);
}
template <class A>
void Fields(A& a, Bone& v) {
  a(v.label, v.name, v.parent, v.voxels, v.centroid, v.box);
}
template <class A>
void Fields(A& a, LabelMending& v) {
  a(v.unused_labels, v.stray_voxels, v.enclosed_voxels);
}
template <class A>
void Fields(A& a, BoneSet& v) {
  a(v.bones, v.labels);
  a.AtTheEnd(v.mending);                // of version 3 of the stage
  a.AtTheEnd(v.mending.shared_voxels);  // of version 4
}
template <class A>
void Fields(A& a, BoneFit& v) {
  a(v.scan_from_template, v.correlation, v.doubt, v.note, v.covariance);
}
template <class A>
void Fields(A& a, DegreeOfFreedom& v) {
  a(v.name, v.axis, v.min_rad, v.max_rad);
}
template <class A>
void Fields(A& a, Joint& v) {
  a(v.child, v.parent, v.centre, v.residual_mm, v.dofs, v.drivers);
}
template <class A>
void Fields(A& a, Skeleton& v) {
  a(v.joints);
}
template <class A>
void Fields(A& a, VoxelWeights& v) {
  a(v.bones, v.weights);
}
template <class A>
void Fields(A& a, Measures& v) {
  a(v.ssd, v.cc, v.mi);
}
template <class A>
void Fields(A& a, StudyBone& v) {
  a(v.label, v.name, v.parent);
}
template <class A>
void Fields(A& a, StudyJoint& v) {
  a(v.child, v.dofs);
}
template <class A>
void Fields(A& a, ConfidenceSummary& v) {
  a(v.mean_percent, v.unsure_fraction);
}
template <class A>
void Fields(A& a, RegisteredScan& v) {
  a(v.scan_from_template, v.control_points, v.control_points_per_level, v.folded_fraction,
    v.place_error_steps, v.confidence);
}

}  // namespace kvx
