// The marrow of one bone of an MR scan, grown from its strokes by minimum cuts in a box around them; the
// cortex is added later (cortex.h).
#pragma once
#include "core/voxels/voxel_box.h"
#include "pipeline/segmentation/cuts/binary_cut.h"
#include "pipeline/segmentation/mr/levels/intensity_mixture.h"
#include "pipeline/segmentation/strokes/carried_strokes.h"
#include "pipeline/segmentation/strokes/stroke_reach.h"

namespace kvx {

// Colours of the marrow, of the rest, and of cortex under strokes. Shared by all bones of a
// scan: each bone's intensities are relative to its own marrow.
struct TissueCounts {
  IntensityCounts marrow, rest, cortex;
  void Add(const TissueCounts& other);
  double CortexLevel() const;  // relative intensity; what is usual when hardly a stroke shows cortex
};

constexpr double kLongMm = 80;  // strokes of shafts, which go on out of the scan

struct StrokeSearch {
  bool tight = false;  // nothing far outside the hull of the strokes; for bones that strokes fill well
  bool far = false;    // farther from the strokes than bones usually reach, and into much else (farther.h)
  bool fine = false;   // between the voxels, too (refined.h)
  bool shell = false;  // and a second time, marrow and cortex together
};

class StrokeBone {
 public:
  // `strokes`: bone labels and kBackgroundStroke, `air`: 1, on the scan's grid. `box` holds all of the bone's
  // strokes.
  StrokeBone(const Volume& scan, const LabelMap& strokes, const LabelMap& air, int label, const VoxelBox& box,
             const StrokeSearch& search);

  TissueCounts Count() const;
  void Cut(const TissueCounts& tissues);
  // The same, of marrow and the dark shell around it together: a surface without one is dear, so what leaked
  // out through a thin spot of the cortex is left out, and less is taken on the strokes' word.
  void CutWithShell(const TissueCounts& tissues);
  // After a cut: the level of the marrow, and what is near and far, are read again from what was found.
  void Reconsider();

  int label() const { return label_; }
  const VoxelBox& box() const { return box_; }
  const Mask& own_strokes() const { return own_; }
  bool IsElsewhere(size_t v) const { return other_.values[v] || air_.values[v]; }  // not the bone, for sure
  const Mask& found() const { return found_; }                                     // marrow
  Mask Marrow() const;  // with strokes in it that were not found
  const Volume& relative() const { return relative_; }
  const Image<float>& lean() const { return lean_; }
  double noise() const { return noise_; }  // of relative intensities
  // A change between neighbouring samples that is an edge when `per_voxel` is one between voxels.
  double EdgeOf(double per_voxel) const;
  // Whether what was found reaches a side of the box beyond which the scan goes on.
  bool ReachesBox() const;
  size_t Voxels() const;  // found; of the search's grid

 private:
  Volume Relative(const Mask& bone) const;
  double Noise() const;
  double SizeMm() const;
  double WallOf(const Image<float>& reach, const std::vector<size_t>& strokes) const;
  void FindLean();
  bool OnInnerSide(size_t voxel) const;
  bool SureStroke(size_t voxel) const;
  CutLayer MarrowLayer(const TissueCounts& tissues, double fat_nats, double lean_nats) const;

  StrokeSearch search_;
  int label_;
  VoxelBox box_;
  Eigen::Array<bool, 3, 1> inner_low_, inner_high_;  // sides of the box beyond which the scan goes on
  Volume scan_, relative_;                           // on the box's grid or refined, as all below; 1: marrow
  Mask own_, other_, air_;          // strokes of this bone; of the background and other bones; air, no stroke
  double noise_ = 0, size_mm_ = 0;  // the diagonal of the strokes' box
  Image<float> remoteness_, lean_;  // lean 1: bone for sure, -1: not
  Mask found_;
};

}  // namespace kvx
