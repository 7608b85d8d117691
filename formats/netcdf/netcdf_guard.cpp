#include <fcntl.h>
#include <fmt/format.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <map>
#include <mutex>
#include <vector>

#include "formats/io/file_stamp.h"
#include "formats/io/module_loader.h"
#include "formats/netcdf/netcdf_file.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"

namespace isohf {
namespace {

/// The header of the classic formats (CDF-1, 2 and 5; "The NetCDF Classic Format Specification"), big-endian.
class ClassicHeader {
 public:
  explicit ClassicHeader(const std::string& path)
      : path_(path), file_(path, std::ios::binary), size_(std::filesystem::file_size(path)) {}

  void require_sound() {
    version_ = number(4) & 0xFFU;
    const auto records = static_cast<double>(count(UINT64_MAX));
    each([&] {
      skip(count(kLongestName));
      dimensions_.push_back(count(UINT64_MAX));
    });
    skip_attributes();
    each([&] { read_variable(); });
    double end = fixed_end_;
    if (records > 0.0) end = std::max(end, record_end_ + (records - 1.0) * (growing_ == 1 ? lone_record_ : record_));
    if (end > static_cast<double>(size_)) {
      corrupt(fmt::format("ends early: it has {} bytes, its variables {:.0f}", size_, end));
    }
  }

 private:
  static constexpr std::uint64_t kLongestName = 256;  // NC_MAX_NAME; libnetcdf does not look
  // libnetcdf makes room for as many as a header claims. No raster has more.
  static constexpr std::uint64_t kMostItems = 65536;
  static constexpr std::uint64_t kMostDimensions = 1024;
  static constexpr std::uint64_t kMostValues = std::uint64_t{1} << 24U;

  [[noreturn]] void corrupt(const std::string& what) const { throw Error(ErrorCode::kCorrupt, path_ + ": " + what); }

  std::uint64_t number(std::size_t bytes) {
    std::array<char, 8> stored{};
    file_.read(stored.data(), static_cast<std::streamsize>(bytes));
    if (!file_) corrupt("its header ends early");
    std::uint64_t value = 0;
    for (std::size_t i = 0; i < bytes; ++i) value = value << 8U | static_cast<unsigned char>(stored[i]);
    return value;
  }
  std::uint64_t count(std::uint64_t most) {
    const std::uint64_t claimed = number(version_ == 5 ? 8 : 4);
    if (claimed > most) corrupt(fmt::format("its header has {} items in a row, at most {} are read", claimed, most));
    return claimed;
  }
  /// Texts and values are padded to four bytes.
  void skip(std::uint64_t bytes) {
    const auto end = static_cast<std::uint64_t>(file_.tellg()) + (bytes + 3) / 4 * 4;
    if (end > size_) corrupt("its header ends early");
    file_.seekg(static_cast<std::streamoff>(end));
  }
  template <typename Item>
  void each(Item item) {
    (void)number(4);  // what kind of list it is
    const std::uint64_t items = count(kMostItems);
    for (std::uint64_t i = 0; i < items; ++i) item();
  }
  std::uint64_t type_bytes() {
    static constexpr std::array<std::uint64_t, 12> kBytes = {0, 1, 1, 2, 4, 4, 8, 1, 2, 4, 8, 8};
    const std::uint64_t type = number(4);
    if (type == 0 || type >= kBytes.size()) corrupt(fmt::format("has values of the type {}", type));
    return kBytes[type];
  }
  void skip_attributes() {
    each([&] {
      skip(count(kLongestName));
      const std::uint64_t bytes = type_bytes();
      skip(bytes * count(kMostValues));
    });
  }
  void read_variable() {
    skip(count(kLongestName));
    const std::uint64_t rank = count(kMostDimensions);
    double bytes = 1.0;
    bool grows = false;  // along the dimension of size 0, in records that have all such variables
    for (std::uint64_t i = 0; i < rank; ++i) {
      const std::uint64_t dimension = count(UINT64_MAX);
      if (dimension >= dimensions_.size()) corrupt("has a variable of a dimension that is not there");
      const std::uint64_t size = dimensions_[dimension];
      grows = grows || size == 0;
      bytes *= size == 0 ? 1.0 : static_cast<double>(size);
    }
    skip_attributes();
    bytes *= static_cast<double>(type_bytes());
    (void)count(UINT64_MAX);  // the same, if it fits
    double& end = grows ? record_end_ : fixed_end_;
    end = std::max(end, static_cast<double>(number(version_ == 1 ? 4 : 8)) + bytes);
    if (!grows) return;
    ++growing_;
    lone_record_ = bytes;
    record_ += 4.0 * std::ceil(bytes / 4.0);
  }

  std::string path_;
  std::ifstream file_;
  std::uint64_t size_;
  std::uint64_t version_ = 1;
  std::vector<std::uint64_t> dimensions_;
  double fixed_end_ = 0.0;
  double record_end_ = 0.0;   ///< of the first record
  double record_ = 0.0;       ///< its bytes
  double lone_record_ = 0.0;  ///< of one variable, which is not padded
  int growing_ = 0;
};

/// All that `program` writes about the file at `path`; nullopt if it cannot be started.
std::optional<std::string> output_of(const std::string& program, const std::string& path) {
  std::array<int, 2> ends{};
  if (::pipe2(ends.data(), O_CLOEXEC) != 0) return std::nullopt;
  ::posix_spawn_file_actions_t actions;
  ::posix_spawn_file_actions_init(&actions);
  ::posix_spawn_file_actions_adddup2(&actions, ends[1], STDOUT_FILENO);
  const std::array<const char*, 3> arguments = {program.c_str(), path.c_str(), nullptr};
  ::pid_t child = 0;
  const int failure =
      ::posix_spawn(&child, program.c_str(), &actions, nullptr, const_cast<char**>(arguments.data()), environ);
  ::posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  std::string output;
  std::array<char, 4096> some{};
  for (::ssize_t bytes = 1; failure == 0 && bytes != 0;) {
    bytes = ::read(ends[0], some.data(), some.size());
    if (bytes > 0) output.append(some.data(), static_cast<std::size_t>(bytes));
    if (bytes < 0 && errno != EINTR) break;
  }
  ::close(ends[0]);
  while (failure == 0 && ::waitpid(child, nullptr, 0) < 0 && errno == EINTR) {
  }
  return failure == 0 ? std::optional(output) : std::nullopt;
}

void require_sound_hdf5(const std::string& path) {
  static std::mutex mutex;
  static std::map<std::string, FileStamp> sound;  // by their paths
  const FileStamp stamp = FileStamp::of(path);
  {
    const std::lock_guard lock(mutex);
    if (const auto found = sound.find(path); found != sound.end() && found->second == stamp) return;
  }
  const std::string program = find_beside_program("isohf-netcdf-probe");
  const auto said = program.empty() ? std::nullopt : output_of(program, path);
  if (said && *said != "sound") {
    const char* const end = said->data() + said->size();
    int code = 0;
    const auto [after, failure] = std::from_chars(said->data(), end, code);
    if (failure == std::errc()) throw Error(static_cast<ErrorCode>(code), trimmed({after, end}));
    throw Error(ErrorCode::kCorrupt,
                path +
                    ": is so damaged that HDF5 breaks down over it, or needs more than 10 s or 2 GiB to look at its "
                    "variables (nccopy -c makes smaller chunks)");
  }
  const std::lock_guard lock(mutex);
  sound[path] = stamp;
}

}  // namespace

void require_sound_netcdf(const std::string& path) {
  std::array<char, 3> magic{};
  std::ifstream(path, std::ios::binary).read(magic.data(), magic.size());
  if (std::string_view(magic.data(), magic.size()) == "CDF") return ClassicHeader(path).require_sound();
  require_sound_hdf5(path);
}

}  // namespace isohf
