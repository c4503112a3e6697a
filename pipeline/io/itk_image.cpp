// ImageIOBase is enough: no pipeline, no templates over pixel types.
#include "pipeline/io/itk_image.h"

#include <itkGDCMImageIO.h>
#include <itkMetaImageIO.h>
#include <itkNiftiImageIO.h>
#include <itkNrrdImageIO.h>

#include <fstream>
#include <limits>
#include <new>

#include "core/errors.h"
#include "pipeline/io/nifti_header.h"
#include "pipeline/io/sound_voxels.h"
#include "pipeline/io/standard_header.h"
#include "pipeline/io/text_geometry.h"

namespace kvx {
namespace {

const char kUnreadable[] =
    "the file is not a readable volume; check that it was copied whole and has the right extension";

// What ITK's objects share is made with the first of them, which must not happen on two threads at once. Its
// warnings are for programmers, and quote paths and headers.
void PrepareItk() {
  [[maybe_unused]] static const bool prepared = [] {
    itk::Object::SetGlobalWarningDisplay(false);
    itk::NrrdImageIO::New(), itk::MetaImageIO::New(), itk::NiftiImageIO::New(), itk::GDCMImageIO::New();
    return true;
  }();
}

itk::ImageIOBase::Pointer MakeIo(FileFormat format) {
  PrepareItk();
  switch (format) {
    case FileFormat::kNrrd:
      return itk::NrrdImageIO::New().GetPointer();
    case FileFormat::kMeta:
      return itk::MetaImageIO::New().GetPointer();
    case FileFormat::kNifti:
      break;
  }
  return itk::NiftiImageIO::New().GetPointer();
}

VoxelType TypeOf(itk::IOComponentEnum type) {
  using C = itk::IOComponentEnum;
  switch (type) {
    case C::UCHAR:
      return VoxelType::kUint8;
    case C::CHAR:
      return VoxelType::kInt8;
    case C::USHORT:
      return VoxelType::kUint16;
    case C::SHORT:
      return VoxelType::kInt16;
    case C::UINT:
      return VoxelType::kUint32;
    case C::INT:
      return VoxelType::kInt32;
    case C::ULONG:
      return sizeof(long) == 8 ? VoxelType::kUint64 : VoxelType::kUint32;
    case C::LONG:
      return sizeof(long) == 8 ? VoxelType::kInt64 : VoxelType::kInt32;
    case C::ULONGLONG:
      return VoxelType::kUint64;
    case C::LONGLONG:
      return VoxelType::kInt64;
    case C::FLOAT:
      return VoxelType::kFloat32;
    case C::DOUBLE:
      return VoxelType::kFloat64;
    default:
      throw InputError("the volume's voxel type is not supported; save it as integers or as 32-bit floats");
  }
}

itk::IOComponentEnum ComponentOf(ScalarType type) {
  using C = itk::IOComponentEnum;
  switch (type) {
    case ScalarType::kUint8:
      return C::UCHAR;
    case ScalarType::kInt8:
      return C::CHAR;
    case ScalarType::kUint16:
      return C::USHORT;
    case ScalarType::kInt16:
      return C::SHORT;
    case ScalarType::kUint32:
      return C::UINT;
    case ScalarType::kInt32:
      return C::INT;
    case ScalarType::kFloat32:
      return C::FLOAT;
    case ScalarType::kFloat64:
      break;
  }
  return C::DOUBLE;
}

int SizeOf(const itk::ImageIOBase& io, unsigned axis) {
  if (axis >= io.GetNumberOfDimensions()) return 1;
  const auto size = io.GetDimensions(axis);
  if (size < 1 || size > 2147483647u)
    throw InputError("the volume's header gives a size that makes no sense; it is damaged");
  return int(size);
}

void RequireScalar(const itk::ImageIOBase& io) {
  if (io.GetNumberOfComponents() != 1) {
    throw InputError(
        "the file holds several values per voxel (colours, vectors, complex numbers or overlapping "
        "segments); "
        "save it with one grey value or one label per voxel");
  }
}

void RequireOneFrame(const itk::ImageIOBase& io) {
  if (io.GetNumberOfDimensions() < 3) throw InputError("the file holds a 2-D image; give a 3-D volume");
  for (unsigned axis = 3; axis < io.GetNumberOfDimensions(); ++axis) {
    if (SizeOf(io, axis) > 1)
      throw InputError("the file holds several frames; save the one you mean as a 3-D volume");
  }
}

// ITK gives files without directions unit ones, which is what we mean too.
ItkHeader HeaderOf(const itk::ImageIOBase& io) {
  RequireOneFrame(io);
  ItkHeader header;
  for (unsigned axis = 0; axis < 3; ++axis) {
    header.grid.size[axis] = SizeOf(io, axis);
    header.grid.spacing_mm[axis] = io.GetSpacing(axis);
    header.grid.origin.lps[axis] = io.GetOrigin(axis);
    const std::vector<double> column = io.GetDirection(axis);
    for (unsigned row = 0; row < 3; ++row) header.grid.direction(row, axis) = column.at(row);
  }
  header.type = TypeOf(io.GetComponentType());
  return header;
}

// ITK turns this one space of NRRD about z instead of mirroring y.
void MendLeftAnteriorSuperior(const TextHeader& nrrd, Grid& grid) {
  const std::string space = SpaceOf(nrrd);
  if (space != "las" && space != "last" && !space.starts_with("leftanteriorsuperior")) return;
  grid.origin.lps.head<2>() *= -1;
  grid.direction.topRows<2>() *= -1;
}

itk::ImageIORegion WholeOf(const itk::ImageIOBase& io) {
  itk::ImageIORegion region(io.GetNumberOfDimensions());
  for (unsigned axis = 0; axis < io.GetNumberOfDimensions(); ++axis)
    region.SetSize(axis, io.GetDimensions(axis));
  return region;
}

// Runs `work`; whatever it throws that is not ours becomes an InputError that says `refusal`. Want of memory
// is none of the file's faults.
template <class Work>
auto Guarded(Work&& work, const char* refusal = kUnreadable) {
  try {
    return work();
  } catch (const Error&) {
    throw;
  } catch (const std::bad_alloc&) {
    throw;
  } catch (const std::exception&) {
    throw InputError(refusal);
  }
}

// `standard` must be there as long as it is read from.
itk::ImageIOBase::Pointer Open(FileFormat format, const StandardHeader& standard) {
  const itk::ImageIOBase::Pointer io = MakeIo(format);
  io->SetFileName(standard.path());
  io->ReadImageInformation();
  return io;
}

std::vector<float> ValuesOf(itk::ImageIOBase& io, size_t count, VoxelType type, const Rescale& rescale) {
  std::vector<char> bytes(count * BytesOf(type));
  io.SetIORegion(WholeOf(io));
  io.Read(bytes.data());
  std::vector<float> values;
  values.reserve(count);
  AppendRescaled(type, rescale, bytes, values);
  return values;
}

size_t HeaderBytes(FileFormat format, std::ifstream& file) {
  if (format == FileFormat::kNifti) return kNifti1VoxelOffset;
  std::string start(4096, '\0');
  file.seekg(0).read(start.data(), std::streamsize(start.size()));
  file.clear();
  const size_t at = start.find(kVoxelsFollow);
  return at == std::string::npos ? start.size() : at + kVoxelsFollow.size();
}

// The length that a gzip stream at the end of the file says of what it holds, modulo 2^32 (RFC 1952).
uint32_t UnpackedLength(std::ifstream& file) {
  uint8_t last[4] = {};
  file.seekg(-4, std::ios::end).read(reinterpret_cast<char*>(last), 4);
  return uint32_t(last[0]) | uint32_t(last[1]) << 8 | uint32_t(last[2]) << 16 | uint32_t(last[3]) << 24;
}

// ITK's writers do not say when the disk was full: what should be in the file is asked of the file itself.
bool IsWhole(FileFormat format, const std::filesystem::path& path, size_t voxel_bytes, bool compressed) {
  std::ifstream file(path, std::ios::binary);
  if (compressed) {
    const size_t packed_header = format == FileFormat::kNifti ? kNifti1VoxelOffset : 0;  // NRRD's stays text
    return UnpackedLength(file) == uint32_t(packed_header + voxel_bytes) && file;
  }
  const size_t header_bytes = HeaderBytes(format, file);
  return file.seekg(0, std::ios::end) && size_t(file.tellg()) == header_bytes + voxel_bytes;
}

struct OpenedImage {
  TextHeader text;
  StandardHeader standard;
  itk::ImageIOBase::Pointer io;
  ItkHeader header;
};

enum class PerVoxel { kOneValue, kSeveral };

OpenedImage OpenChecked(FileFormat format, const std::filesystem::path& path, PerVoxel allowed) {
  TextHeader text = ReadTextHeader(format, path);
  const double available = MostVoxelBytes(text);
  RequireGeometry(text);
  StandardHeader standard(text);
  OpenedImage image{std::move(text), std::move(standard), {}, {}};
  image.io = Open(format, image.standard);
  image.header = HeaderOf(*image.io);
  if (format == FileFormat::kNrrd) MendLeftAnteriorSuperior(image.text, image.header.grid);
  if (allowed == PerVoxel::kOneValue) RequireScalar(*image.io);
  const double mm = MmPerUnit(image.text);
  image.header.grid.spacing_mm *= mm;
  image.header.grid.origin.lps *= mm;
  image.header.rescale = RescaleOf(image.text);
  RequirePlausible(image.header.grid, image.header.type, available / image.io->GetNumberOfComponents());
  return image;
}

std::vector<float> SoundValuesOf(const OpenedImage& image) {
  const size_t count = image.header.grid.VoxelCount() * image.io->GetNumberOfComponents();
  RequireSoundVoxels(image.text, count, count * BytesOf(image.header.type));
  return ValuesOf(*image.io, count, image.header.type, image.header.rescale);
}

}  // namespace

ItkHeader ReadItkHeader(FileFormat format, const std::filesystem::path& path) {
  return Guarded([&] { return OpenChecked(format, path, PerVoxel::kOneValue).header; });
}

Scan ReadItkScan(FileFormat format, const std::filesystem::path& path) {
  return Guarded([&] {
    const OpenedImage image = OpenChecked(format, path, PerVoxel::kOneValue);
    Scan scan;
    scan.volume.grid = image.header.grid;
    scan.stored_as = StoredAs(image.header.type, image.header.rescale);
    scan.volume.values = SoundValuesOf(image);
    return scan;
  });
}

ItkLayers ReadItkLayers(const std::filesystem::path& nrrd, bool with_values) {
  return Guarded([&] {
    const OpenedImage image = OpenChecked(FileFormat::kNrrd, nrrd, PerVoxel::kSeveral);
    ItkLayers layers{image.header.grid, int(image.io->GetNumberOfComponents()), {}};
    if (with_values) layers.values = SoundValuesOf(image);
    return layers;
  });
}

ItkPlanes ReadDicomPlanes(const std::filesystem::path& file, bool with_values, const char* undecoded) {
  const auto read = [&] {
    PrepareItk();
    const itk::GDCMImageIO::Pointer io = itk::GDCMImageIO::New();
    io->SetFileName(file.string());
    io->ReadImageInformation();
    RequireScalar(*io);
    ItkPlanes planes{SizeOf(*io, 0),
                     SizeOf(*io, 1),
                     SizeOf(*io, 2),
                     TypeOf(io->GetComponentType()),
                     {io->GetRescaleSlope(), io->GetRescaleIntercept()},
                     {}};
    if (!with_values) return planes;
    planes.values = ValuesOf(*io, size_t(planes.columns) * planes.rows * planes.count, planes.type, {});
    return planes;
  };
  return Guarded(read, undecoded);
}

void WriteItk(FileFormat format, const std::filesystem::path& path, const Grid& grid, ScalarType type,
              int components, const std::string& bytes, bool compressed) {
  constexpr int kMostOfNifti = std::numeric_limits<int16_t>::max();
  if (format == FileFormat::kNifti && grid.size.maxCoeff() > kMostOfNifti)
    throw InputError(
        "NIfTI holds at most 32767 voxels along an axis; choose .nrrd or .mha, or a coarser grid");
  const itk::ImageIOBase::Pointer io = MakeIo(format);
  io->SetNumberOfDimensions(3);
  for (unsigned axis = 0; axis < 3; ++axis) {
    io->SetDimensions(axis, unsigned(grid.size[axis]));
    io->SetSpacing(axis, grid.spacing_mm[axis]);
    io->SetOrigin(axis, grid.origin.lps[axis]);
    const Eigen::Vector3d column = grid.direction.col(axis);
    io->SetDirection(axis, std::vector<double>(column.begin(), column.end()));
  }
  io->SetComponentType(ComponentOf(type));
  io->SetPixelType(components == 1 ? itk::IOPixelEnum::SCALAR : itk::IOPixelEnum::VECTOR);
  io->SetNumberOfComponents(unsigned(components));
  io->SetUseCompression(compressed);
  io->SetIORegion(WholeOf(*io));
  io->SetFileName(path.string());
  const auto written = [&] {
    try {
      io->WriteImageInformation();
      io->Write(bytes.data());
      return IsWhole(format, path, bytes.size(), compressed);
    } catch (const std::exception&) {
      return false;
    }
  };
  if (!written())
    throw Unavailable("a volume cannot be written; is the output folder writable and the disk not full?");
}

}  // namespace kvx
