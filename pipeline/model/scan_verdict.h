// Whether a scan belongs to its study, as far as its bones tell.
#pragma once
#include <string>
#include <string_view>

#include "core/pose.h"
#include "pipeline/model/model.h"

namespace kvx {

struct ScanVerdict {
  enum class Kind {
    kBelongs,
    kLost,         // bones in doubt, each for itself, hold more than half of all bones' voxels
    kMirrored,     // it shows the bones' mirror images
    kAnotherSize,  // another person's, its voxel sizes are wrong, or the limb moved
  };
  Kind kind = Kind::kBelongs;
  std::string note;  // what is wrong and what to do; empty of scans that belong
};
ScanVerdict VerdictOf(const BoneSet& bones, const BoneFits& fits);
ScanVerdict VerdictOf(const Model& model, const std::string& scan);  // the template belongs; throws NotFound
std::string_view NameOf(ScanVerdict::Kind kind);                     // as in the model's document

}  // namespace kvx
