// What a user is told about a study that may not be what was meant: its files, label map and tree.
#pragma once
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "core/bone.h"
#include "core/digest.h"
#include "core/scan.h"
#include "core/study.h"
#include "pipeline/registration/paper/paper_options.h"

namespace kvx {

// Lines where the published method was told to end early.
std::vector<std::string> LimitWarnings(const PaperOptions& paper);

// A line for each file that several scans share: it was chosen twice. Of each scan its name and file.
std::vector<std::string> SameScanWarnings(const std::vector<std::pair<std::string, Digest>>& scans);

// A line where some scans are of Hounsfield units and others are not. Of each scan its name and whether it
// is.
std::vector<std::string> ModalityWarnings(const std::vector<std::pair<std::string, bool>>& in_hounsfield);

// A line for a scan that calls itself CT and is not in Hounsfield units (Scan::denied_ct), and one where its
// slices took turns in brightness (Scan::evened_slices). Each begins with what the scan is called.
std::vector<std::string> ScanWarnings(const std::string& called, const Scan& scan);

// A line for fields of the study file that nobody reads.
std::vector<std::string> UnreadFieldWarnings(const std::vector<std::string>& fields);

// A line where bones of the template are given other places than their labels': nothing uses those.
std::vector<std::string> TemplatePoseWarnings(const Study& study);

// A line each for labels that no bone has, for voxels that mending took from bones, for those that it gave
// them, and for those that masks share.
std::vector<std::string> LabelWarnings(const BoneSet& bones);

// A line where bones' masks hold voxels that are another's: of each bone its name and how many.
std::vector<std::string> SharedVoxelWarnings(const std::vector<std::pair<std::string, size_t>>& shared);

// A line for bones that the segmentation itself calls by another bone's name: DICOM numbers segments without
// gaps, so a knee without its fibula has the patella in the fibula's place. `names`: by label.
std::vector<std::string> SegmentNameWarnings(const BoneSet& bones, const std::map<int, std::string>& names,
                                             Region region);

// A line for bones of the region that the label map lacks, though it has others.
std::vector<std::string> MissingBoneWarnings(const BoneSet& bones, Region region);

// A line for bones that look like others of their region: two labels may have changed places.
std::vector<std::string> NameWarnings(const BoneSet& bones, Region region);

// A line for bones that lie far from one that they should meet at a joint (an end is missing), and one for
// others that lie far from their parent, another bone much nearer: the tree is not that of joints.
std::vector<std::string> ParentWarnings(const BoneSet& bones, Region region);

// A line where the map's borders lie beside the scan's edges, and how far to move it, or on none at all: a
// map of another scan, or one that a tool has moved or mirrored. Smaller errors do not show.
std::vector<std::string> MisplacedLabelWarnings(const Volume& template_scan, const LabelMap& labels);

// A line where all of the template's grid is body: no air was found.
std::vector<std::string> NoAirWarnings(const Mask& body);

// A line for the bones that lie partly in air: a map of another scan, or one that a tool has mirrored or
// moved.
std::vector<std::string> BonesOutsideBody(const BoneSet& bones, const Mask& body);

// A line where the template shows more than a tenth of the body's volume beside it as bright as the body's
// brighter half: another limb, whose bones are not in the map.
std::vector<std::string> TissueBesideBody(const Volume& scan, const Mask& body);

}  // namespace kvx
