// A posed model as a DICOM series: what an archive's list of series shows of the pose, and its bones as a
// segmentation of that series.
#pragma once
#include "pipeline/io/dicom/dicom_writer.h"
#include "pipeline/model/model.h"

namespace kvx {

struct PosedAs {
  PoseRequest request;
  DeformationMode mode = DeformationMode::kEvd;
  int level = 0;
  double extrapolation = 0;  // of the worst placed bone, in typical distances between examples
};

struct SeriesText {
  std::string description;  // ASCII, at most 64 letters: what does not fit is counted
  std::string comment;      // the whole pose; ASCII, at most 10240 letters
};
// Scans go by their number among `scan_names`, from 1: their names may say who was scanned.
SeriesText TextOf(const PosedAs& posed, const std::vector<std::string>& scan_names);

// `modality`: empty for the template scan's own.
DicomSeries SeriesOf(const Model& model, const PosedAs& posed, const std::string& modality,
                     const std::string& patient_id);

// A DICOM segmentation (one file) of the images that `posed` makes as a series; `labels` lie on its grid.
void WritePosedBones(const std::filesystem::path& path, const Model& model, const LabelMap& labels,
                     const Volume& posed, const DicomSeries& series);

}  // namespace kvx
