// What NRRD and MetaImage headers say. Our reading is the only one: ITK never sees such a header, but what
// standard_header.h makes of it, so that no file can say one thing to us and another to ITK.
#pragma once
#include <cstdint>
#include <filesystem>
#include <initializer_list>
#include <map>
#include <string>
#include <vector>

#include "pipeline/io/itk_image.h"

namespace kvx {

struct TextHeader {
  FileFormat format = FileFormat::kNrrd;
  std::map<std::string, std::string> fields;  // keys in lower case, values trimmed
  std::map<std::string, std::string> notes;   // a NRRD's "key:=value", likewise
  int64_t lines = 0, bytes = 0;               // of the header, with the line that ends it
  std::filesystem::path voxels;               // the file that holds them; `attached`: behind the header
  bool attached = true;

  std::string Value(const std::string& key) const;  // empty where it does not say
  // Of a field with several names, the first that says something; else empty.
  std::string FirstOf(std::initializer_list<const char*> names) const;
};

// Throws InputError for headers that are damaged, say a thing twice or have no end, for sizes or dimensions
// that make no sense, and for data files that do not lie beside the header: it must not reach elsewhere.
// Only .nhdr and .mhd have data files.
TextHeader ReadTextHeader(FileFormat format, const std::filesystem::path& path);

// Whether a header's line can name a file beside it so: it loses spaces around the name, and takes LIST and %
// for many files.
bool IsNameable(const std::string& data_file);

// What lies in front of the voxels in their file, an attached header included: lines, then bytes; those of a
// packed NRRD are packed with its voxels. Bytes -1: whatever there is, the voxels end the file. Throws
// InputError for what is no such number.
struct VoxelStart {
  int64_t lines = 0, bytes = 0;
};
VoxelStart VoxelStartOf(const TextHeader& header);

// How the voxels of a MetaImage are stored.
bool IsPackedMeta(const TextHeader& meta);
bool IsTextMeta(const TextHeader& meta);
// The bytes of packed ones: as many as it says, or all behind the header.
int64_t PackedBytesOf(const TextHeader& meta);

// Upper bound of the bytes that the voxels can unpack to, from the size of the file on disk. Throws
// InputError for a packing that is not read.
double MostVoxelBytes(const TextHeader& header);

// What its lengths are in; 1 where nothing says. Throws InputError for units that are no lengths or differ.
double MmPerUnit(const TextHeader& header);

// Of a MetaImage's voxels; a NRRD has none. Throws InputError for what makes no sense.
Rescale RescaleOf(const TextHeader& header);

// A NRRD's space in one of the ways that its name may be written: "leftanteriorsuperior" or "las".
std::string SpaceOf(const TextHeader& nrrd);

// Where a segment of a NRRD segmentation is, as 3D Slicer writes it: in which of the values that a voxel has,
// and which value; and what the file calls it.
struct Segment {
  int layer = 0, value = 0;
  std::string name;
};
bool NamesSegments(const TextHeader& nrrd);  // a segmentation, by its own account
// In the file's order; none where it says nothing of segments. Throws InputError for what makes no sense.
std::vector<Segment> SegmentsOf(const TextHeader& nrrd);

}  // namespace kvx
