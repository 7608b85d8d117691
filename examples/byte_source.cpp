// Reads an archive through a byte source of one's own, as from a web server or an object store; here a file, and every
// range that is asked for is counted.
//   byte_source dem.isohf
#include <atomic>
#include <cstdio>
#include <fstream>
#include <mutex>

#include "isohf/isohf.h"

class CountedFile : public isohf::ByteSource {
 public:
  explicit CountedFile(const std::string& path) : file_(path, std::ios::binary | std::ios::ate) {
    if (!file_) throw isohf::Error(isohf::ErrorCode::kIo, path + ": cannot be opened");
    size_ = static_cast<std::uint64_t>(file_.tellg());
  }
  std::uint64_t size_bytes() const override { return size_; }
  /// Called from any thread.
  std::size_t read(std::uint64_t offset_bytes, std::span<std::byte> out) const override {
    const std::lock_guard lock(mutex_);
    ++ranges;
    file_.seekg(static_cast<std::streamoff>(offset_bytes));
    file_.read(reinterpret_cast<char*>(out.data()), static_cast<std::streamsize>(out.size()));
    return static_cast<std::size_t>(file_.gcount());
  }
  mutable std::atomic<int> ranges = 0;

 private:
  mutable std::mutex mutex_;
  mutable std::ifstream file_;
  std::uint64_t size_ = 0;
};

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "usage: byte_source ARCHIVE\n"), 2;
  try {
    const auto file = std::make_shared<const CountedFile>(argv[1]);
    const isohf::ArchiveReader archive(file, argv[1]);
    std::printf("opened by %d ranges\n", file->ranges.load());
    const std::vector<double> elevations = archive.read_elevations({0, 0});
    std::printf("%zu elevations of tile (0,0), %d ranges\n", elevations.size(), file->ranges.load());
    return 0;
  } catch (const isohf::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
