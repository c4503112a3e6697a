// How near a bone that strokes found is likely to be to the true one.
#pragma once
#include <span>

#include "pipeline/segmentation/strokes/found_bone.h"

namespace kvx {

// Each from 0 to 1.
struct SearchSigns {
  double agreement = 1;    // Dice of the answer that was taken with the others, in the mean
  double stayed = 1;       // Dice of that answer with what it became when its surface was placed
  double unclear = 0;      // share of the surface without dark cortex under it
  double marked = 0;       // share of the bone that strokes mark
  bool bare = false;       // strokes lie where hardly more than them was found
  double dark_inside = 0;  // share of what lies deep in it that is darker than marrow
  double dark_muscle = 0;  // how much darker than usual muscle is in the scan (UsualMuscle)
};

// The bone's Dice with the true one that is to be expected, by what such signs meant in phantoms of which the
// truth is known (docs/results/strokes.md): two of three bones lie within 0.05 of it. 0 to 1.
double ExpectedDice(const SearchSigns& signs);

constexpr double kSureDice = 0.85;  // from here on, that few voxels were added to its strokes says nothing

// Below, somebody should look at the bone: of scans with dark muscle less is sure.
constexpr double DoubtfulDice(double dark_muscle) { return dark_muscle > 0 ? 0.85 : 0.82; }

// Of a scan's voxels; 0 of two that are empty.
double Dice(const FoundBone& a, const FoundBone& b);

// Of the chosen answer with each of the others, in the mean; 1 without others.
double Agreement(std::span<const FoundBone> answers, size_t chosen);

}  // namespace kvx
