#include "formats/exr/exr_header.h"

#include <OpenEXR/openexr.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <memory>
#include <span>

#include "formats/readers.h"
#include "isohf/base/text/text.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr std::array<unsigned char, 4> kMagic = {0x76, 0x2F, 0x31, 0x01};
/// Chunks up to this size are believed whatever the size of the file; larger ones must be possible at a compression
/// twice as good as deflate's limit of 1032 : 1.
constexpr std::uint64_t kUnquestionedChunkBytes = std::uint64_t{32} << 20U;
constexpr std::uint64_t kMaxCompressionRatio = 2048;
/// A chunk's place in the table of chunks, and its row and length.
constexpr std::uint64_t kLeastChunkBytes = 16;

/// Damaged attributes are left out by the library with a message alone.
thread_local std::string first_complaint;
void on_error(exr_const_context_t /*file*/, exr_result_t /*code*/, const char* text) {
  if (first_complaint.empty()) first_complaint = text;
}

struct Finish {
  void operator()(exr_context_t file) const { exr_finish(&file); }
};

void check_part(exr_const_context_t file, int part, std::uint64_t file_size) {
  std::int32_t chunks = 0;
  std::uint64_t chunk_bytes = 0;
  exr_attr_box2i_t box{};
  if (exr_get_chunk_count(file, part, &chunks) != EXR_ERR_SUCCESS ||
      exr_get_chunk_unpacked_size(file, part, &chunk_bytes) != EXR_ERR_SUCCESS ||
      exr_get_data_window(file, part, &box) != EXR_ERR_SUCCESS) {
    throw Error(ErrorCode::kCorrupt, "OpenEXR: " + one_line(first_complaint));
  }
  if (chunks < 1 || static_cast<std::uint64_t>(chunks) > file_size / kLeastChunkBytes) {
    throw Error(ErrorCode::kCorrupt,
                fmt::format("OpenEXR header declares {} x {} pixels in {} chunks, for which a file of {} bytes has no "
                            "room",
                            std::int64_t{box.max.x} - box.min.x + 1, std::int64_t{box.max.y} - box.min.y + 1, chunks,
                            file_size));
  }
  const std::uint64_t limit =
      std::min(std::max(kUnquestionedChunkBytes, file_size * kMaxCompressionRatio), kMaxExrChunkBytes);
  if (chunk_bytes <= limit) return;
  throw Error(ErrorCode::kUnsupported, fmt::format("OpenEXR chunks of {} bytes are larger than {} MiB, the most for a "
                                                   "file of {} bytes",
                                                   chunk_bytes, limit >> 20U, file_size));
}

}  // namespace

bool looks_like_exr(std::span<const std::byte> head) {
  return head.size() >= kMagic.size() && std::memcmp(head.data(), kMagic.data(), kMagic.size()) == 0;
}

std::vector<std::int64_t> check_exr_headers(const std::string& path) {
  exr_context_initializer_t settings = EXR_DEFAULT_CONTEXT_INITIALIZER;
  settings.error_handler_fn = on_error;
  first_complaint.clear();
  exr_context_t opened = nullptr;
  const exr_result_t result = exr_start_read(&opened, path.c_str(), &settings);
  const std::unique_ptr<_priv_exr_context_t, Finish> file(opened);
  if (result != EXR_ERR_SUCCESS || !first_complaint.empty()) {
    throw Error(ErrorCode::kCorrupt, "OpenEXR header: " + one_line(first_complaint));
  }
  const std::uint64_t file_size = std::filesystem::file_size(path);
  int parts = 0;
  exr_get_count(opened, &parts);
  std::vector<std::int64_t> rows_of_chunks;
  for (int part = 0; part < parts; ++part) {
    check_part(opened, part, file_size);
    std::int32_t rows = 0;
    if (exr_get_scanlines_per_chunk(opened, part, &rows) != EXR_ERR_SUCCESS) rows = 0;
    rows_of_chunks.push_back(rows);
  }
  return rows_of_chunks;
}

}  // namespace isohf
