#include "formats/netcdf/netcdf_module.h"

#include <fcntl.h>
#include <netcdf.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstring>
#include <mutex>
#include <string>
#include <vector>

#include "formats/module_inside.h"
#include "isohf/error.h"

// The module is a library of its own: it shares headers with isohf, no code.

struct IsohfNetcdfFile {
  int id = -1;
};

namespace {

using isohf::Error;
using isohf::ErrorCode;

static_assert(NC_MAX_NAME + 1 <= sizeof IsohfNetcdfVariable::name);
static_assert(sizeof(size_t) == sizeof(uint64_t));

std::mutex& one_at_a_time() {
  static std::mutex mutex;
  return mutex;
}

void require(int status) {
  if (status == NC_NOERR) return;
  if (status == NC_ENOFILTER) {
    throw Error(ErrorCode::kUnsupported,
                "is packed by a filter that HDF5 does not have here; its plug-in in HDF5_PLUGIN_PATH lets it be read, "
                "and h5repack -f GZIP=6 where it is installed makes a file that needs none");
  }
  const bool is_system = status > 0 || status == NC_ENOMEM;
  throw Error(status == NC_ENOMEM ? ErrorCode::kOutOfMemory
              : is_system         ? ErrorCode::kIo
                                  : ErrorCode::kCorrupt,
              std::string("libnetcdf finds it damaged: ") + nc_strerror(status));
}

template <typename Action>
int call(IsohfNetcdfMessage* message, Action action) {
  const std::lock_guard lock(one_at_a_time());
  return isohf::guarded(message, "libnetcdf", ErrorCode::kCorrupt, action);
}

/// A chunk is decoded whole for one of its samples: larger ones are left to whoever wants what is in them.
constexpr double kMostProbed = 0x1p24;

/// Asks libnetcdf for all that it is going to be asked for, and for the first and the last sample of everything.
void ask_for_everything(const char* path) {
  int id = -1;
  int variables = 0;
  if (nc_open(path, NC_NOWRITE, &id) != NC_NOERR || nc_inq_nvars(id, &variables) != NC_NOERR) return;
  for (int variable = NC_GLOBAL; variable < variables; ++variable) {
    int attributes = 0;
    if (nc_inq_varnatts(id, variable, &attributes) != NC_NOERR) continue;
    for (int i = 0; i < attributes; ++i) {
      std::array<char, NC_MAX_NAME + 1> name{};
      nc_type type = 0;
      size_t count = 0;
      if (nc_inq_attname(id, variable, i, name.data()) != NC_NOERR ||
          nc_inq_att(id, variable, name.data(), &type, &count) != NC_NOERR || type != NC_STRING) {
        continue;
      }
      std::vector<char*> texts(count, nullptr);
      if (nc_get_att_string(id, variable, name.data(), texts.data()) == NC_NOERR) nc_free_string(count, texts.data());
    }
    std::array<int, NC_MAX_VAR_DIMS> dimensions{};
    int rank = 0;
    nc_type type = 0;
    if (variable < 0 || nc_inq_var(id, variable, nullptr, &type, &rank, dimensions.data(), nullptr) != NC_NOERR ||
        type > NC_UINT64) {
      continue;
    }
    std::array<size_t, NC_MAX_VAR_DIMS> chunk{};
    int storage = NC_CONTIGUOUS;
    if (nc_inq_var_chunking(id, variable, &storage, chunk.data()) != NC_NOERR) continue;
    double samples = storage == NC_CHUNKED ? 1.0 : 0.0;
    for (std::size_t i = 0; i < static_cast<std::size_t>(rank); ++i) samples *= static_cast<double>(chunk[i]);
    if (samples > kMostProbed) continue;
    std::vector<size_t> at(static_cast<std::size_t>(rank), 0);
    std::array<char, 8> sample{};
    if (nc_get_var1(id, variable, at.data(), sample.data()) != NC_NOERR) continue;
    for (std::size_t i = 0; i < at.size(); ++i) {
      if (nc_inq_dimlen(id, dimensions[i], &at[i]) == NC_NOERR && at[i] > 0) --at[i];
    }
    (void)nc_get_var1(id, variable, at.data(), sample.data());
  }
}

/// HDF5 ends the whole program on some damaged files (1.10: what has no checksum). Another process finds out first.
void require_harmless(const char* path) {
  constexpr unsigned kMostSeconds = 10;
  const pid_t child = ::fork();
  if (child < 0) return;
  if (child == 0) {
    const rlimit none{0, 0};
    ::setrlimit(RLIMIT_CORE, &none);
    ::dup2(::open("/dev/null", O_WRONLY | O_CLOEXEC), STDERR_FILENO);
    for (const int sign : {SIGSEGV, SIGBUS, SIGFPE, SIGILL, SIGABRT, SIGALRM, SIGTERM}) std::signal(sign, SIG_DFL);
    ::alarm(kMostSeconds);
    try {
      ask_for_everything(path);
    } catch (...) {  // what the caller will be told
    }
    ::_exit(0);
  }
  int status = 0;
  while (::waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM) {
    throw Error(ErrorCode::kUnsupported,
                "HDF5 needs more than 10 s to look at its variables; nccopy makes a file of "
                "smaller chunks (-c) that is quicker to read");
  }
  if (status != 0) throw Error(ErrorCode::kCorrupt, "is so damaged that HDF5 breaks down over it");
}

/// Files that keep their rasters in groups, as BAG and HDF-EOS do.
void require_outside_groups(int id, int variables) {
  int groups = 0;
  require(nc_inq_grps(id, &groups, nullptr));
  int most = 0;
  for (int variable = 0; variable < variables; ++variable) {
    int rank = 0;
    require(nc_inq_varndims(id, variable, &rank));
    most = rank > most ? rank : most;
  }
  if (groups == 0 || most >= 2) return;
  std::vector<int> list(static_cast<std::size_t>(groups));
  require(nc_inq_grps(id, nullptr, list.data()));
  std::array<char, NC_MAX_NAME + 1> name{};
  require(nc_inq_grpname(list[0], name.data()));
  throw Error(ErrorCode::kUnsupported, std::string("keeps its variables in groups (") + name.data() +
                                           ", ...), which isohf does not read; gdal_translate makes a GeoTIFF of one");
}

int open_file(const char* path, IsohfNetcdfFile** file, IsohfNetcdfCounts* counts, IsohfNetcdfMessage* message) {
  return call(message, [&] {
    require_harmless(path);
    int id = -1;
    require(nc_open(path, NC_NOWRITE, &id));
    *file = new IsohfNetcdfFile{id};
    int growing = 0;
    require(nc_inq(id, &counts->dimensions, &counts->variables, &counts->attributes, &growing));
    require_outside_groups(id, counts->variables);
  });
}

int dimension(IsohfNetcdfFile* file, int32_t index, char* name, uint64_t* size, IsohfNetcdfMessage* message) {
  return call(message, [&] {
    size_t length = 0;
    require(nc_inq_dim(file->id, index, name, &length));
    *size = length;
  });
}

int describe(IsohfNetcdfFile* file, int32_t index, IsohfNetcdfVariable* variable, IsohfNetcdfMessage* message) {
  return call(message, [&] {
    std::array<int, NC_MAX_VAR_DIMS> dimensions{};
    nc_type type = 0;
    require(
        nc_inq_var(file->id, index, variable->name, &type, &variable->rank, dimensions.data(), &variable->attributes));
    variable->type = type;
    if (variable->rank > ISOHF_NETCDF_RANK) variable->rank = 0;
    std::array<size_t, NC_MAX_VAR_DIMS> chunk{};
    int storage = NC_CONTIGUOUS;
    require(nc_inq_var_chunking(file->id, index, &storage, chunk.data()));
    for (int i = 0; i < variable->rank; ++i) {
      const auto at = static_cast<std::size_t>(i);
      variable->dimensions[i] = dimensions[at];
      variable->chunk[i] = storage == NC_CHUNKED ? chunk[at] : 0;
    }
  });
}

int attribute_of(IsohfNetcdfFile* file, int32_t variable, int32_t index, IsohfNetcdfAttribute* attribute,
                 IsohfNetcdfMessage* message) {
  return call(message, [&] {
    require(nc_inq_attname(file->id, variable, index, attribute->name));
    nc_type type = 0;
    size_t count = 0;
    require(nc_inq_att(file->id, variable, attribute->name, &type, &count));
    attribute->type = type;
    attribute->count = count;
    if (type != NC_STRING) return;
    // A list of texts: the first of them.
    std::vector<char*> texts(count, nullptr);
    if (count > 0) require(nc_get_att_string(file->id, variable, attribute->name, texts.data()));
    attribute->type = NC_CHAR;
    attribute->count = count > 0 && texts[0] != nullptr ? std::strlen(texts[0]) : 0;
    if (count > 0) require(nc_free_string(count, texts.data()));
  });
}

int value(IsohfNetcdfFile* file, int32_t variable, const IsohfNetcdfAttribute* attribute, char* text, double* numbers,
          IsohfNetcdfMessage* message) {
  return call(message, [&] {
    if (attribute->type != NC_CHAR) {
      require(nc_get_att_double(file->id, variable, attribute->name, numbers));
      return;
    }
    nc_type type = 0;
    size_t count = 0;
    require(nc_inq_att(file->id, variable, attribute->name, &type, &count));
    if (type == NC_CHAR) {
      require(nc_get_att_text(file->id, variable, attribute->name, text));
      return;
    }
    std::vector<char*> texts(count, nullptr);
    if (count == 0) return;
    require(nc_get_att_string(file->id, variable, attribute->name, texts.data()));
    if (texts[0] != nullptr) std::memcpy(text, texts[0], attribute->count);
    require(nc_free_string(count, texts.data()));
  });
}

int numbers_of(IsohfNetcdfFile* file, int32_t variable, uint64_t first, uint64_t count, double* numbers,
               IsohfNetcdfMessage* message) {
  return call(message, [&] {
    const size_t start = first;
    const size_t length = count;
    require(nc_get_vara_double(file->id, variable, &start, &length, numbers));
  });
}

int read_box(IsohfNetcdfFile* file, int32_t variable, const uint64_t* start, const uint64_t* count, void* samples,
             IsohfNetcdfMessage* message) {
  return call(message, [&] { require(nc_get_vara(file->id, variable, start, count, samples)); });
}

void keep(IsohfNetcdfFile* file, int32_t variable, uint64_t bytes, uint64_t chunks) {
  const std::lock_guard lock(one_at_a_time());
  // Rows are read in their order: what was read to the end goes first. Slots: ten times the chunks, as HDF5 advises.
  constexpr uint64_t kLeastSlots = 521;
  nc_set_var_chunk_cache(file->id, variable, bytes, 10 * chunks + kLeastSlots, 1.0F);
}

void close_file(IsohfNetcdfFile* file) {
  const std::lock_guard lock(one_at_a_time());
  nc_close(file->id);
  delete file;
}

const char* library() {
  static const std::string name = [] {
    const std::string version = nc_inq_libvers();  // "4.9.0 of Jun 12 2022 ..."
    return "libnetcdf " + version.substr(0, version.find(' '));
  }();
  return name.c_str();
}

}  // namespace

extern "C" __attribute__((visibility("default"))) const IsohfNetcdfModule* isohf_netcdf_module(void) {
  static const IsohfNetcdfModule module = {ISOHF_NETCDF_ABI, open_file, dimension, describe,   attribute_of, value,
                                           numbers_of,       read_box,  keep,      close_file, library};
  return &module;
}
