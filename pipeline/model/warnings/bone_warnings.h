// What a user is told about bones whose poses in a scan are in doubt.
#pragma once
#include <map>
#include <string>
#include <vector>

#include "core/bone.h"
#include "core/measures.h"
#include "core/pose.h"
#include "pipeline/bones/refine/pose_hint.h"

namespace kvx {

// A line on a scan that does not belong (scan_verdict.h), one for each reason to doubt bones, with their
// names, one that names the uncertain bones, and one on how well the coarse bones are known.
std::vector<std::string> BoneWarnings(const std::string& scan, const BoneSet& bones, const BoneFits& fits);

// What to do about uncertain bones; empty where no scan has any.
std::string UncertainBonesAdvice(const BoneSet& bones, const std::vector<BoneFits>& scans);

// A line where no scan of several belongs: the template may be the odd one.
std::vector<std::string> TemplateWarnings(const BoneSet& bones, const std::vector<BoneFits>& scans);

// A line for the bones that were found elsewhere than their hints have them (IsNearHint): nearer hints were
// used.
std::vector<std::string> UnusedHintWarnings(const std::string& scan, const BoneSet& bones,
                                            const BoneFits& fits, const PoseHints& hints);

// How well the coarse bones of a scan are known, together; empty where it has none.
std::string CoarseBonesText(const BoneSet& bones, const BoneFits& fits);

// That posing does without a scan in a part of the body, 0 .. 1, which its lost bones move.
std::string HiddenTissueText(const std::string& scan, double part);

// A line where the registration is unsure in so much of the body that something is wrong with the scan.
std::vector<std::string> UnsureTissueWarnings(const std::string& scan, double part);

// A line where registration left a scan less like the template than bones alone do, by every measure.
// `by_stage`: as MeasureScan::Output has them.
std::vector<std::string> LessAlikeWarnings(const std::string& scan,
                                           const std::map<std::string, Measures>& by_stage);

}  // namespace kvx
