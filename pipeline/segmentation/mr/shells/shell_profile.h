// What a scan shows on a line out of a bone: marrow, a dark shell of up to three voxels, other tissue,
// blurred.
#pragma once
#include <array>
#include <cmath>
#include <vector>

namespace kvx {

// Lengths are in voxels, intensities relative to the marrow's level.
class ShellProfile {
 public:
  static constexpr int kSamples = 11, kOffsets = 21;
  using Samples = std::array<float, kSamples>;
  using Misfits = std::array<float, kOffsets>;  // mean squares, by where the shell's outer side is put

  static double PlaceOf(int sample) { return -1.5 + 0.25 * sample; }     // outwards
  static double OffsetOf(int offset) { return -1.25 + 0.125 * offset; }  // of the shell's outer side

  // `blur`: normal deviation of the scan's and of sampling between voxels. `radius`: of the bone, a round one
  // that lines go out of from its axis; infinite for a flat surface.
  ShellProfile(double blur, double thickness, double radius = INFINITY);
  // How badly the samples are explained, when marrow and other tissue are as bright as fits best. Samples
  // that are not a number have no say, and fewer samples say less.
  Misfits MisfitsOf(const Samples& samples) const;

 private:
  // With the shell's outer side at one offset: how much of each sample is what.
  struct Shares {
    Samples marrow, shell, other;
    double marrow2, marrow_other, other2;  // sums of products
    void Sum();
  };
  static Shares SharesOfSeen(const Shares& shares, const Samples& samples);
  float MisfitOf(const Shares& shares, const Samples& samples) const;
  std::vector<Shares> shares_;  // one per offset
};

}  // namespace kvx
