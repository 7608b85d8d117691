#include "formats/netcdf/netcdf_file.h"

#include <H5Epublic.h>
#include <netcdf.h>

#include <algorithm>
#include <array>
#include <mutex>

#include "isohf/base/text/text.h"
#include "isohf/error.h"

namespace isohf {
namespace {

std::unique_lock<std::recursive_mutex> one_at_a_time() {
  static std::recursive_mutex mutex;
  std::unique_lock lock(mutex);
  // HDF5 prints its errors; libnetcdf has it keep quiet in the first thread alone.
  thread_local const bool is_quiet = H5Eset_auto2(H5E_DEFAULT, nullptr, nullptr) >= 0;
  (void)is_quiet;
  return lock;
}

std::optional<SampleType> sample_type(int type, bool is_unsigned) {
  static constexpr std::array<std::optional<SampleType>, 12> kTypes = {
      std::nullopt,        SampleType::kInt8,    std::nullopt,         SampleType::kInt16,
      SampleType::kInt32,  SampleType::kFloat32, SampleType::kFloat64, SampleType::kUint8,
      SampleType::kUint16, SampleType::kUint32,  SampleType::kFloat64, SampleType::kFloat64};
  if (is_unsigned && type == NC_BYTE) return SampleType::kUint8;
  if (is_unsigned && type == NC_SHORT) return SampleType::kUint16;
  return type >= 0 && type <= NC_UINT64 ? kTypes[static_cast<std::size_t>(type)] : std::nullopt;
}

}  // namespace

NetcdfFile::NetcdfFile(const std::string& path) : path_(path) {
  const auto lock = one_at_a_time();
  require(nc_open(path.c_str(), NC_NOWRITE, &id_));
  try {
    int count = 0;
    int format = 0;
    require(nc_inq_nvars(id_, &count));
    require(nc_inq_format(id_, &format));
    is_hdf5_ = format == NC_FORMAT_NETCDF4 || format == NC_FORMAT_NETCDF4_CLASSIC;
    for (int id = 0; id < count; ++id) variables_.push_back(describe(id));
    require_no_groups();
  } catch (...) {
    nc_close(id_);
    throw;
  }
}

NetcdfFile::~NetcdfFile() {
  const auto lock = one_at_a_time();
  nc_close(id_);
}

void NetcdfFile::require(int status) const {
  if (status == NC_NOERR) return;
  if (status == NC_ENOFILTER) {
    throw Error(ErrorCode::kUnsupported,
                path_ +
                    ": is packed by a filter that HDF5 does not have here; its plug-in in HDF5_PLUGIN_PATH lets it "
                    "be read, and h5repack -f GZIP=6 where it is installed makes a file that needs none");
  }
  const ErrorCode code = status == NC_ENOMEM              ? ErrorCode::kOutOfMemory
                         : status > 0 && status != EINVAL ? ErrorCode::kIo  // errno
                                                          : ErrorCode::kCorrupt;
  throw Error(code, path_ + ": libnetcdf finds it damaged: " + nc_strerror(status));
}

NetcdfFile::Variable NetcdfFile::describe(int id) const {
  std::array<char, NC_MAX_NAME + 1> name{};
  Variable variable;
  int rank = 0;
  require(nc_inq_var(id_, id, name.data(), &variable.type, &rank, nullptr, nullptr));
  variable.id = id;
  variable.name = name.data();
  variable.sample_type = sample_type(variable.type, text(id, "_Unsigned") == "true");
  std::vector<int> dimensions(static_cast<std::size_t>(rank));
  require(nc_inq_vardimid(id_, id, dimensions.data()));
  for (const int dimension : dimensions) {
    std::size_t size = 0;
    require(nc_inq_dim(id_, dimension, name.data(), &size));
    variable.dimensions.emplace_back(name.data());
    variable.sizes.push_back(size);
  }
  int storage = NC_CONTIGUOUS;
  variable.chunk.resize(std::max<std::size_t>(dimensions.size(), 1));
  require(nc_inq_var_chunking(id_, id, &storage, variable.chunk.data()));
  if (storage != NC_CHUNKED) variable.chunk.clear();
  return variable;
}

/// Files that keep their rasters in groups, as BAG and HDF-EOS do.
void NetcdfFile::require_no_groups() const {
  int groups = 0;
  require(nc_inq_grps(id_, &groups, nullptr));
  if (groups == 0 || std::ranges::any_of(variables_, [](const Variable& v) { return v.sizes.size() >= 2; })) return;
  throw Error(
      ErrorCode::kUnsupported,
      path_ + ": keeps its variables in groups, which isohf does not read; gdal_translate makes a GeoTIFF of one");
}

const NetcdfFile::Variable* NetcdfFile::variable(std::string_view name) const {
  const auto found = std::ranges::find(variables_, name, &Variable::name);
  return found == variables_.end() ? nullptr : &*found;
}

NetcdfFile::Attribute NetcdfFile::attribute_of(int variable, const char* name) const {
  Attribute found;
  const int status = nc_inq_att(id_, variable, name, &found.type, &found.count);
  if (status == NC_ENOTATT) return {};
  require(status);
  constexpr std::size_t kMostItems = std::size_t{1} << 20U;  // longer ones describe no raster
  return found.count <= kMostItems ? found : Attribute{};
}

std::string NetcdfFile::text(int variable, const char* name) const {
  const auto lock = one_at_a_time();
  const auto [type, count] = attribute_of(variable, name);
  if (count == 0 || (type != NC_CHAR && type != NC_STRING)) return {};
  if (type == NC_CHAR) {
    std::string value(count, '\0');
    require(nc_get_att_text(id_, variable, name, value.data()));
    return trimmed(value);
  }
  std::vector<char*> values(count, nullptr);
  require(nc_get_att_string(id_, variable, name, values.data()));
  const std::string first = values[0] != nullptr ? trimmed(values[0]) : "";
  nc_free_string(count, values.data());
  return first;
}

std::vector<double> NetcdfFile::numbers(int variable, const char* name) const {
  const auto lock = one_at_a_time();
  const auto [type, count] = attribute_of(variable, name);
  if (type == NC_CHAR || type > NC_UINT64) return {};
  std::vector<double> list(count);
  if (count > 0) require(nc_get_att_double(id_, variable, name, list.data()));
  return list;
}

std::optional<double> NetcdfFile::number(int variable, const char* name) const {
  const std::vector<double> list = numbers(variable, name);
  return list.empty() ? std::nullopt : std::optional(list.front());
}

std::vector<double> NetcdfFile::values(const Variable& variable, std::size_t first, std::size_t count) const {
  std::vector<std::size_t> start(variable.sizes.size(), 0);
  std::vector<std::size_t> counts = variable.sizes;
  start.at(0) = first;
  counts.at(0) = count;
  std::size_t samples = 1;
  for (const std::size_t size : counts) samples *= size;
  std::vector<double> list(samples);
  const auto lock = one_at_a_time();
  require(nc_get_vara_double(id_, variable.id, start.data(), counts.data(), list.data()));
  return list;
}

void NetcdfFile::read(const Variable& variable, const std::vector<std::size_t>& start,
                      const std::vector<std::size_t>& count, std::span<std::byte> samples) const {
  const auto lock = one_at_a_time();
  require(nc_get_vara(id_, variable.id, start.data(), count.data(), samples.data()));
}

void NetcdfFile::keep_chunks(const Variable& variable, std::uint64_t bytes, std::uint64_t chunks) const {
  const auto lock = one_at_a_time();
  // Rows are read in their order: what was read to the end goes first. Slots: ten times the chunks, as HDF5 advises.
  constexpr std::uint64_t kLeastSlots = 521;
  require(nc_set_var_chunk_cache(id_, variable.id, bytes, 10 * chunks + kLeastSlots, 1.0F));
}

std::string netcdf_library() {
  const std::string version = nc_inq_libvers();  // "4.9.0 of Jun 12 2022 ..."
  return "libnetcdf " + version.substr(0, version.find(' '));
}

}  // namespace isohf
