// What opening an archive takes: resident memory, reads, milliseconds; of 17 million tiles, a thousandth of them stored and
// all. The archives have index, directory and metadata as if their tiles were there, and a hole in place of these.
// usage: open_bench FOLDER [MILLIONS OF TILES]

#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdlib>

#include "isohf/archive.h"
#include "isohf/archive/archive_index_builder.h"
#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/deflate/deflate.h"

namespace isohf {
namespace {

constexpr std::uint64_t kTileBytes = 100;

void make(const std::string& path, const TileGrid& grid, std::int64_t every) {
  OutputFile file(path, {.overwrite = true, .buffer_bytes = std::size_t{4} << 20U});
  ArchiveIndexBuilder contents(grid, {}, ".");
  std::vector<std::byte> bytes;
  JournalRecord record;
  record.kind = JournalRecord::Kind::kMember;
  record.member = {kMediaTypeName,    ZipMethod::kStored, crc32(std::as_bytes(std::span(kMediaType))),
                   kMediaType.size(), kMediaType.size(),  0};
  append_local_header(record.member, bytes);
  file.append(bytes);
  file.append(std::as_bytes(std::span(kMediaType)));
  contents.add(record);
  std::uint64_t at = file.position();
  for (std::int64_t flat = 0; flat < grid.tile_count(); ++flat) {
    // One tile in so many, near each other in each row, as land is.
    const TileIndex tile = grid.tile_at(flat);
    record.kind = every == 1 || (tile.row % 32 == 0 && tile.column < grid.tile_columns() * 32 / every)
                      ? JournalRecord::Kind::kTile
                      : JournalRecord::Kind::kEmptyTile;
    if (record.kind == JournalRecord::Kind::kTile) {
      record.member = {tile_name(tile), ZipMethod::kDeflated, 1, kTileBytes, kTileBytes + 1, at};
      at += local_header_bytes(record.member) + kTileBytes;
      record.code_max = static_cast<std::uint32_t>(flat % 60000);
    }
    contents.add(record);
  }
  file.flush();
  file.truncate(at);
  const ZipMember index = contents.append_index(file);
  Metadata metadata(grid);
  metadata.content_sha256 = metadata.ground_sha256 = std::string(64, '0');
  metadata.tiles_stored = contents.tiles_stored();
  const std::string json = format_metadata(metadata);
  const auto text = std::as_bytes(std::span<const char>(json));
  const ZipMember last{kMetadataName, ZipMethod::kStored, crc32(text), text.size(), text.size(), file.position()};
  bytes.clear();
  append_local_header(last, bytes);
  file.append(bytes);
  file.append(text);
  contents.append_directory(index, last, file);
  file.commit();
}

/// A file that counts what is asked of it.
class Counted final : public ByteSource {
 public:
  explicit Counted(const std::string& path) : file_(open_file_source(path)) {}
  [[nodiscard]] std::uint64_t size_bytes() const override { return file_->size_bytes(); }
  [[nodiscard]] std::size_t read(std::uint64_t offset_bytes, std::span<std::byte> out) const override {
    ++reads;
    return file_->read(offset_bytes, out);
  }
  mutable std::atomic<int> reads = 0;

 private:
  std::shared_ptr<const ByteSource> file_;
};

double resident_mb() {
  struct rusage usage {};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

/// In a process of its own, whose memory nothing else has touched.
void measure(const std::string& path) {
  std::fflush(stdout);
  const pid_t child = fork();
  if (child != 0) {
    waitpid(child, nullptr, 0);
    return;
  }
  execl("/proc/self/exe", "open_bench", "--open", path.c_str(), nullptr);
  std::_Exit(1);
}

int open_once(const std::string& path) {
  const double before = resident_mb();
  const auto source = std::make_shared<Counted>(path);
  const auto start = std::chrono::steady_clock::now();
  const ArchiveReader archive(source, path);
  const auto opened = std::chrono::steady_clock::now();
  const int reads = source->reads;
  std::int64_t stored = 0;
  const TileGrid& grid = archive.grid();
  for (std::int64_t i = 0; i < 1000; ++i) {
    const std::int64_t flat = i * (grid.tile_count() / 1000);
    stored += archive.tile_entry(grid.tile_at(flat)).stored ? 1 : 0;
  }
  const double after = resident_mb();
  fmt::print(
      "{}: {} of {} tiles stored, opened in {} reads, {:.2f} ms; 1000 entries ({} stored) in {} reads more; resident "
      "{:.1f} MB, {:.1f} before\n",
      path, archive.tables().front().stored, grid.tile_count(), reads,
      std::chrono::duration<double, std::milli>(opened - start).count(), stored, source->reads - reads, after, before);
  return 0;
}

}  // namespace
}  // namespace isohf

int main(int argc, char** argv) {
  using namespace isohf;
  if (argc == 3 && std::string(argv[1]) == "--open") return open_once(argv[2]);
  if (argc < 2) return 2;
  const double millions = argc > 2 ? std::atof(argv[2]) : 17.0;
  const auto side = static_cast<std::int64_t>(std::sqrt(millions * 1e6)) + 1;
  const TileGrid grid = TileGrid::make(TileShape::make(5, 5, 1), side, side, 1.0, 1.0);
  for (const std::int64_t every : {1000, 1}) {
    const std::string path = fmt::format("{}/every_{}.isohf", argv[1], every);
    make(path, grid, every);
    fmt::print("made in {:.1f} MB resident\n", resident_mb());
    for (int round = 0; round < 3; ++round) measure(path);
    std::remove(path.c_str());
  }
  return 0;
}
