// What a user is told of a template that is bent more than every scan of it, a fist say.
#pragma once
#include <span>
#include <string>
#include <vector>

#include "core/pose.h"
#include "core/skeleton.h"

namespace kvx {

// A line where all scans that belong show the joints straighter than the template, by 10 degrees on average
// and the straightest by 25, some joint of it by 45. Creased tissue touches itself and hides what the scans
// show; a given fist as template had twice to four times the errors of the straight hand. By the long axes of
// the bones at joints that turn, where both bones are long and not doubtful. Of each scan its name and fits.
std::vector<std::string> BentTemplateWarnings(const std::string& template_name, const BoneSet& bones,
                                              const Skeleton& skeleton,
                                              const std::vector<std::string>& scan_names,
                                              std::span<const BoneFits> scans);

}  // namespace kvx
