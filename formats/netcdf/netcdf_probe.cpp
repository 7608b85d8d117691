/// isohf-netcdf-probe FILE: reads of a netCDF-4 file whatever isohf reads before the samples, and samples at two ends of
/// every variable, so that HDF5 breaks down here, on damage, and not in the program that wants the file.
///
/// Prints "sound" if the file was opened, else the number of an ErrorCode, a blank and the message.

#include <fcntl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <iostream>

#include "formats/netcdf/netcdf_file.h"
#include "isohf/error.h"

namespace {

constexpr rlim_t kMostSeconds = 10;  ///< of computing; waiting for a disk is no damage
constexpr unsigned kMostSecondsInAll = 60;
constexpr rlim_t kMostBytes = rlim_t{2} << 30U;
/// A chunk is decoded whole for one of its samples: larger ones are left to whoever wants what is in them.
constexpr double kMostSamples = 0x1p24;

void limit(__rlimit_resource resource, rlim_t most) {
  const rlimit both{most, most};
  ::setrlimit(resource, &both);
}

void read_ends(const isohf::NetcdfFile& file, const isohf::NetcdfFile::Variable& variable) {
  double samples = 1.0;
  for (const std::size_t size : variable.chunk) samples *= static_cast<double>(size);
  if (!variable.sample_type || samples > kMostSamples) return;
  const std::vector<std::size_t> one(variable.sizes.size(), 1);
  std::vector<std::size_t> at(variable.sizes.size(), 0);
  std::byte sample[8];
  file.read(variable, at, one, sample);
  for (std::size_t i = 0; i < at.size(); ++i) at[i] = variable.sizes[i] - 1;
  file.read(variable, at, one, sample);
}

void read_all(const isohf::NetcdfFile& file) {
  (void)file.text(isohf::NetcdfFile::kGlobal, "Conventions");
  for (const auto& variable : file.variables()) {
    (void)file.text(variable.id, "units");  // libnetcdf reads a variable's attributes all at once
    try {
      read_ends(file, variable);
    } catch (const isohf::Error&) {  // perhaps nobody wants this variable
    }
  }
}

}  // namespace

int main(int count, char** arguments) {
  if (count != 2) return 2;
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_CPU, kMostSeconds);
#ifndef ISOHF_SANITIZED  // AddressSanitizer reserves terabytes
  limit(RLIMIT_AS, kMostBytes);
#endif
  std::signal(SIGALRM, SIG_DFL);
  ::alarm(kMostSecondsInAll);
  ::dup2(::open("/dev/null", O_WRONLY | O_CLOEXEC), STDERR_FILENO);  // HDF5's own account of its errors
  try {
    read_all(isohf::NetcdfFile(arguments[1]));
    std::cout << "sound" << std::flush;
  } catch (const isohf::Error& error) {
    std::cout << static_cast<int>(error.code()) << ' ' << error.what() << std::flush;
  }
  ::_exit(0);  // what the libraries do at the end of a program is not looked at
}
