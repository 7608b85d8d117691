#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "isohf/raster.h"

namespace isohf {

/// A netCDF file, classic or netCDF-4, as libnetcdf reads it. Neither libnetcdf nor HDF5 is for threads: one call runs at
/// a time, whatever the file. Functions throw Error naming the path: kCorrupt, kIo, kUnsupported, kOutOfMemory.
class NetcdfFile {
 public:
  struct Variable {
    int id = 0;
    std::string name;
    int type = 0;                           ///< as netcdf.h numbers them
    std::optional<SampleType> sample_type;  ///< as samples are delivered; nullopt: these are not numbers
    std::vector<std::string> dimensions;    ///< their names
    std::vector<std::size_t> sizes;         ///< along each of them
    std::vector<std::size_t> chunk;         ///< samples that are stored together; empty: the variable has no chunks
  };
  static constexpr int kGlobal = -1;  ///< in place of a variable's id: the file's own attributes

  explicit NetcdfFile(const std::string& path);
  NetcdfFile(const NetcdfFile&) = delete;
  NetcdfFile& operator=(const NetcdfFile&) = delete;
  ~NetcdfFile();

  [[nodiscard]] bool is_hdf5() const { return is_hdf5_; }
  [[nodiscard]] const std::vector<Variable>& variables() const { return variables_; }
  [[nodiscard]] const Variable* variable(std::string_view name) const;  ///< nullptr: there is none

  /// The text of an attribute without blanks around it, or the first of several; empty if there is none.
  [[nodiscard]] std::string text(int variable, const char* name) const;
  /// The numbers of an attribute; empty if there are none.
  [[nodiscard]] std::vector<double> numbers(int variable, const char* name) const;
  [[nodiscard]] std::optional<double> number(int variable, const char* name) const;  ///< the first of them

  /// The values of a variable at `count` places along its first dimension, from `first` on.
  [[nodiscard]] std::vector<double> values(const Variable& variable, std::size_t first, std::size_t count) const;
  /// The samples of a box in the variable's own type and host byte order. start, count  one for each dimension
  void read(const Variable& variable, const std::vector<std::size_t>& start, const std::vector<std::size_t>& count,
            std::span<std::byte> samples) const;
  /// How much is kept of a variable's decoded chunks.
  void keep_chunks(const Variable& variable, std::uint64_t bytes, std::uint64_t chunks) const;

 private:
  struct Attribute {
    int type = 0;
    std::size_t count = 0;  ///< 0: there is none
  };

  void require(int status) const;
  [[nodiscard]] Variable describe(int id) const;
  void require_no_groups() const;
  [[nodiscard]] Attribute attribute_of(int variable, const char* name) const;

  std::string path_;
  int id_ = -1;
  bool is_hdf5_ = false;
  std::vector<Variable> variables_;
};

/// Throws Error naming the path for a netCDF file that libnetcdf must not open: a classic header whose claims the file
/// does not hold, which libnetcdf believes (it reads zeros behind a file's end); and an HDF5 file over which HDF5 ends
/// the program, or computes for ever. isohf-netcdf-probe finds the latter out in a process of its own, once for each
/// state of a file; if that program is not found (find_beside_program), HDF5 files are opened without.
void require_sound_netcdf(const std::string& path);

/// "libnetcdf 4.9.0": the library as it runs.
[[nodiscard]] std::string netcdf_library();

}  // namespace isohf
