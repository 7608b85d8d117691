// What a conversion cannot do without: reading its input, and compressing what it ends up with. Reads the whole raster
// with isohf's own reader, then compresses the payloads of an archive's tiles again with libdeflate, at some levels and
// at the one that comes nearest to the archive's size; all timed, on THREADS threads. usage: floor RASTER PAYLOADS
// ARCHIVE_TILE_BYTES THREADS PAYLOADS is one payload after the other, each behind its length as a little-endian 32-bit
// number (scripts/bench makes it). Prints one JSON object.

#include <fmt/format.h>
#include <libdeflate.h>
#include <oneapi/tbb/blocked_range.h>
#include <oneapi/tbb/enumerable_thread_specific.h>
#include <oneapi/tbb/global_control.h>
#include <oneapi/tbb/parallel_for.h>
#include <oneapi/tbb/task_arena.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstring>
#include <memory>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "formats/registry.h"
#include "isohf/base/source_bytes.h"
#include "isohf/error.h"
#include "isohf/raster.h"
#include "isohf/surface/source/source_rows.h"

namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

std::vector<std::span<const std::byte>> payloads_in(std::span<const std::byte> bytes) {
  std::vector<std::span<const std::byte>> payloads;
  while (bytes.size() >= 4) {
    std::uint32_t size = 0;
    std::memcpy(&size, bytes.data(), 4);
    if (size > bytes.size() - 4) throw isohf::Error(isohf::ErrorCode::kCorrupt, "the payloads end in the middle");
    payloads.push_back(bytes.subspan(4, size));
    bytes = bytes.subspan(4 + std::size_t{size});
  }
  return payloads;
}

/// A compressor and room for what it makes; one a thread.
struct Deflater {
  explicit Deflater(int level) : compressor(libdeflate_alloc_compressor(level), libdeflate_free_compressor) {}
  std::size_t size_of(std::span<const std::byte> bytes) {
    out.resize(libdeflate_deflate_compress_bound(compressor.get(), bytes.size()));
    return libdeflate_deflate_compress(compressor.get(), bytes.data(), bytes.size(), out.data(), out.size());
  }
  std::unique_ptr<libdeflate_compressor, decltype(&libdeflate_free_compressor)> compressor;
  std::vector<std::byte> out;
};

/// Bytes of every `stride`th payload at a level.
std::size_t deflated_bytes(std::span<const std::span<const std::byte>> payloads, int level, std::size_t stride) {
  std::atomic<std::size_t> total = 0;
  oneapi::tbb::enumerable_thread_specific<Deflater> deflaters([level] { return Deflater(level); });
  oneapi::tbb::parallel_for(std::size_t{0}, (payloads.size() + stride - 1) / stride,
                            [&](std::size_t i) { total += deflaters.local().size_of(payloads[i * stride]); });
  return total;
}

double read_all(isohf::HeightSource& source) {
  const isohf::SourceInfo& info = source.info();
  constexpr std::uint64_t kReadBytes = std::uint64_t{4} << 20U;
  const isohf::ReadStep step = isohf::ReadStep::make(info, kReadBytes);
  source.limit_buffers(2 * kReadBytes);
  std::vector<std::byte> raw(step.most_bytes(info));
  const auto start = Clock::now();
  for (std::int64_t row = 0; row < info.height; row += step.rows) {
    for (const isohf::Window& window : step.windows(info, row)) {
      const auto bytes = static_cast<std::size_t>(window.columns * window.rows) * isohf::size_bytes(info.sample_type);
      source.read_window(window, std::span(raw).first(bytes));
    }
  }
  return seconds_since(start);
}

/// The level whose bytes come nearest to the archive's, told by a sample of the payloads.
int nearest_level(std::span<const std::span<const std::byte>> payloads, double archive_bytes) {
  const std::size_t stride = std::max<std::size_t>(1, payloads.size() / 50);
  const auto all = static_cast<double>(deflated_bytes(payloads, 1, 1));
  const auto part = static_cast<double>(deflated_bytes(payloads, 1, stride));
  int level = 1;
  double nearest = HUGE_VAL;
  for (int candidate = 1; candidate <= 12; ++candidate) {
    const double bytes = static_cast<double>(deflated_bytes(payloads, candidate, stride)) / part * all;
    if (std::abs(bytes - archive_bytes) < nearest) {
      nearest = std::abs(bytes - archive_bytes);
      level = candidate;
    }
  }
  return level;
}

void run(const std::string& raster, const std::string& payload_file, double archive_bytes) {
  const auto source = isohf::open_file_source(payload_file);
  const isohf::SourceBytes file(*source, 0, source->size_bytes());
  const std::vector<std::span<const std::byte>> payloads = payloads_in(file.bytes());
  const int nearest = nearest_level(payloads, archive_bytes);
  const double read_seconds = read_all(*isohf::open_raster(raster, {}));
  std::set<int> levels = {1, 3, 6, 9, 12};
  levels.insert(nearest);
  std::string deflated;
  for (const int level : levels) {
    const auto start = Clock::now();
    const std::size_t bytes = deflated_bytes(payloads, level, 1);
    deflated += fmt::format(R"({}{{"level": {}, "deflate_s": {:.4f}, "bytes": {}}})", deflated.empty() ? "" : ", ",
                            level, seconds_since(start), bytes);
  }
  fmt::print(R"({{"read_s": {:.4f}, "nearest": {}, "payload_bytes": {}, "levels": [{}]}})"
             "\n",
             read_seconds, nearest, file.bytes().size() - 4 * payloads.size(), deflated);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 5) {
    fmt::print(stderr, "usage: floor RASTER PAYLOADS ARCHIVE_TILE_BYTES THREADS\n");
    return 2;
  }
  try {
    const int threads = std::stoi(argv[4]);
    const oneapi::tbb::global_control workers(oneapi::tbb::global_control::max_allowed_parallelism,
                                              static_cast<std::size_t>(threads));
    oneapi::tbb::task_arena(threads).execute([&] { run(argv[1], argv[2], std::stod(argv[3])); });
    return 0;
  } catch (const std::exception& error) {
    fmt::print(stderr, "{}\n", error.what());
    return 1;
  }
}
