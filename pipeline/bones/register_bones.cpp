// Eq. 1 for one scan: searches, then whether the scan shows the template's bones at all.
#include "pipeline/bones/register_bones.h"

#include <cstdio>

#include "pipeline/bones/images/even_light.h"
#include "pipeline/bones/judge/mirror_image.h"
#include "pipeline/bones/search/scan_searches.h"
#include "pipeline/scans/finer_scan.h"
#include "pipeline/scans/measured_box.h"

namespace kvx {
namespace {

// Below, the scan's mirror image is searched, too: a mirrored knee's bones match by 0.75 to 0.85.
constexpr double kRightCorrelation = 0.8;
constexpr double kOtherVoxels = 1.1;  // times as long, or as short, along some axis

const std::map<std::string, RigidTransform> kNoHints;

const Grid& TemplateGrid(const RegisterBones::Inputs& inputs) { return inputs.shown.scan()->volume.grid; }

SearchScene SceneOf(const RegisterBones::Inputs& inputs, const Scan& scan,
                    const std::map<std::string, RigidTransform>& hints, StageContext& context) {
  Volume seen = AsFineAs(EvenlyLit(*Measured(scan)), TemplateGrid(inputs).MeanSpacingMm());
  const double finest_mm = FinestMm(TemplateGrid(inputs), seen.grid);
  return {inputs.shown.Lit(), std::move(seen), inputs.shown.scan()->modality, scan.modality, finest_mm, hints,
          context.backend,    context.progress};
}

// Whether its mirror image shows the template's bones far better than the scan itself.
bool IsMirrored(const SearchScene& scene, const SoughtBones& sought, const FoundBones& as_it_is) {
  const SearchScene mirrored{scene.template_volume, Mirrored(scene.scan), scene.template_modality,
                             scene.modality,        scene.finest_mm,      kNoHints,
                             scene.backend,         scene.progress};
  return FindsFarMore(SearchFromAnySide(mirrored, sought), as_it_is);
}

bool ShowsMirrorImages(const SearchScene& scene, const SoughtBones& sought, const FoundBones& found) {
  if (MirrorNats(sought, scene.scan, found.fits) > kFarMoreNats) return true;
  const bool matches_badly = MayLieOtherwise(found) || found.sure_correlation < kRightCorrelation;
  return matches_badly && IsMirrored(scene, sought, found);
}

const std::string kWhyMirrored =
    "the scan shows mirror images of the template's bones; it may be of the body's other side, or a tool has "
    "flipped it: export it again, or leave it out of the study";

// Whether the bones of a scan that are lost are there once its voxels are taken to be the template's.
bool HasVoxelsOfTemplate(const RegisterBones::Inputs& inputs, const FoundBones& as_it_is,
                         StageContext& context) {
  const Eigen::Vector3d& spacing_mm = TemplateGrid(inputs).spacing_mm;
  const Eigen::Array3d times = spacing_mm.array() / inputs.scan->volume.grid.spacing_mm.array();
  if ((times.log().abs() < std::log(kOtherVoxels)).all()) return false;
  Scan scan = *inputs.scan;
  scan.volume.grid.spacing_mm = spacing_mm;
  const SearchScene scene = SceneOf(inputs, scan, kNoHints, context);
  return FindsFarMore(SearchFromAnySide(scene, inputs.shown.Sought(scene.finest_mm)), as_it_is);
}

std::string Text(const Eigen::Vector3d& spacing_mm) {
  char text[80];
  std::snprintf(text, sizeof text, "%.3g x %.3g x %.3g mm", spacing_mm.x(), spacing_mm.y(), spacing_mm.z());
  return text;
}

std::string WhyOtherVoxels(const RegisterBones::Inputs& inputs) {
  return "the bones are not found with its voxels of " + Text(inputs.scan->volume.grid.spacing_mm) +
         ", and are with those of the template, " + Text(TemplateGrid(inputs).spacing_mm) +
         ": one of the two seems to have lost its voxel sizes; export it again with them";
}

}  // namespace

BoneFits RegisterBones::Run(const Inputs& inputs, const Options& options, StageContext& context) {
  const SearchScene scene = SceneOf(inputs, *inputs.scan, options.initial_poses, context);
  const SoughtBones& sought = inputs.shown.Sought(scene.finest_mm);
  FoundBones found = SearchEveryWay(scene, sought);
  if (ShowsMirrorImages(scene, sought, found))
    DoubtAll(Doubt::kMirrored, kWhyMirrored, found.fits);
  else if (!Succeeded(found) && HasVoxelsOfTemplate(inputs, found, context))
    DoubtAll(Doubt::kAnotherSize, WhyOtherVoxels(inputs), found.fits);
  return inputs.shown.InOrder(std::move(found.fits));
}

}  // namespace kvx
