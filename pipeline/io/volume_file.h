// Reading and writing scans: NIfTI, NRRD, MetaImage, DICOM series. World is LPS mm on our side, whatever the
// file says. Errors never hold a path or header text. ITK stays behind this header.
#pragma once
#include <filesystem>
#include <string>

#include "core/scan.h"
#include "pipeline/io/layered_labels.h"
#include "pipeline/io/volume_info.h"

namespace kvx {

// `path` is a .nii, .nii.gz, .nrrd, .nhdr, .mha, .mhd file, a .dcm of many frames or a folder with one DICOM
// series. Any integer or float type; rescale slope and intercept are applied, lengths become mm whatever unit
// the header names. Throws InputError with a remedy
// for what is not a 3-D scalar volume: 2-D, 4-D with more than one frame, vectors, colours, several or
// irregular DICOM series, truncated or absurd headers. "Not a number" is read as the scan's smallest value,
// as what was not measured is filled up with elsewhere (pipeline/scans).
Scan ReadScan(const std::filesystem::path& path);
bool HoldsDicom(const std::filesystem::path& path);  // a folder, or a .dcm file
// The file beside a .mhd or .nhdr that holds its voxels; empty for everything else. Throws InputError where
// the header names none that lies beside it.
std::filesystem::path DetachedData(const std::filesystem::path& path);
VolumeInfo ReadVolumeInfo(const std::filesystem::path& path);  // header only where the format allows
// As a scan, but a DICOM segmentation (SEG, pipeline/io/dicom/dicom_segments.h), which is no scan, counts
// before other DICOM images. Integer values 0..65535, or segments in layers, numbered in their order
// (pipeline/io/segment_layers.h); "not a number" is 0. Throws InputError otherwise.
LabelMap ReadLabels(const std::filesystem::path& path);
LayeredLabels ReadLayeredLabels(const std::filesystem::path& path);  // the same, with what layers share
Grid ReadLabelsGrid(const std::filesystem::path& path);

// Throws now what writing would throw in the end for this extension.
void RequireWritableExtension(const std::filesystem::path& path);
// Format by extension (.nii, .nii.gz, .nrrd, .mha, .mhd); values are rounded and clamped to `type`. Written
// to a temporary name, synced and renamed, so a reader never sees half a file. Throws InputError for an
// unknown extension, Unavailable for a full disk.
void WriteVolume(const std::filesystem::path& path, const Volume& volume, ScalarType type);
void WriteLabels(const std::filesystem::path& path, const LabelMap& labels);
void WriteField(const std::filesystem::path& path,
                const DisplacementField& field);  // 3-vector float32, LPS mm

}  // namespace kvx
