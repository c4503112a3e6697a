// What is doubted of the whole scan is said by each of its bones.
#include "pipeline/model/scan_verdict.h"

namespace kvx {
namespace {

constexpr double kLostPart = 0.5;

double DoubtfulPart(const BoneSet& bones, const BoneFits& fits) {
  double doubtful = 0, all = 0;
  for (size_t b = 0; b < fits.size(); ++b) {
    const double voxels = double(bones.bones.at(b).voxels);
    doubtful += fits[b].Doubtful() ? voxels : 0, all += voxels;
  }
  return all > 0 ? doubtful / all : 0;
}

}  // namespace

ScanVerdict VerdictOf(const BoneSet& bones, const BoneFits& fits) {
  for (const BoneFit& fit : fits) {
    if (fit.doubt == Doubt::kMirrored) return {ScanVerdict::Kind::kMirrored, fit.note};
    if (fit.doubt == Doubt::kAnotherSize) return {ScanVerdict::Kind::kAnotherSize, fit.note};
  }
  if (DoubtfulPart(bones, fits) <= kLostPart) return {};
  return {ScanVerdict::Kind::kLost,
          "most of its bones are in doubt; is it this person's, does it show the region of the template, are "
          "its bones in view and its voxel sizes right? Give initial poses, or leave it out of the study"};
}

ScanVerdict VerdictOf(const Model& model, const std::string& scan) {
  if (scan == model.manifest().template_scan) return {};
  return VerdictOf(model.bones(), model.scan_fits()[size_t(ScanIndex(model, scan))]);
}

std::string_view NameOf(ScanVerdict::Kind kind) {
  switch (kind) {
    case ScanVerdict::Kind::kLost:
      return "lost";
    case ScanVerdict::Kind::kMirrored:
      return "mirrored";
    case ScanVerdict::Kind::kAnotherSize:
      return "another_size";
    default:
      return "belongs";
  }
}

}  // namespace kvx
