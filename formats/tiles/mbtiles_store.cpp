#include <fmt/format.h>

#include <array>
#include <cstring>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "formats/files/raw_file.h"
#include "formats/files/text.h"
#include "formats/module_loader.h"
#include "formats/readers.h"
#include "formats/tiles/mbtiles_module.h"
#include "formats/tiles/tile_store.h"
#include "isohf/error.h"

namespace isohf {
namespace {

const IsohfMbtilesModule& mbtiles_module() {
  return *static_cast<const IsohfMbtilesModule*>(
      load_module({"isohf_mbtiles.so", ISOHF_MBTILES_SYMBOL, ISOHF_MBTILES_ABI, "MBTiles need the SQLite module",
                   "ISOHF_BUILD_MBTILES_MODULE"}));
}

class MbtilesStore final : public TileStore {
 public:
  explicit MbtilesStore(const std::string& path) : module_(mbtiles_module()), path_(path) {
    const auto bytes = static_cast<std::int64_t>(whole_pages_bytes(path));
    check([&](IsohfMbtilesMessage* message) { return module_.open(path.c_str(), bytes, &file_, message); });
  }
  ~MbtilesStore() override { module_.close(file_); }

  [[nodiscard]] std::pair<int, int> zooms() override {
    std::int32_t first = 0;
    std::int32_t last = 0;
    check([&](IsohfMbtilesMessage* message) { return module_.zooms(file_, &first, &last, message); });
    return {first, last};
  }

  [[nodiscard]] std::optional<Box> box(int zoom) override {
    std::int64_t box[6] = {};
    std::int64_t count = 0;
    check([&](IsohfMbtilesMessage* message) { return module_.box(file_, zoom, box, &count, message); });
    if (count == 0) return std::nullopt;
    return Box{box[0], box[1], box[2], box[3], {zoom, box[4], box[5]}};
  }

  [[nodiscard]] bool read(const TilePlace& place, std::vector<std::byte>& stored) override {
    return take(stored, [&](IsohfMbtilesTake taking, void* to, IsohfMbtilesMessage* message) {
      return module_.tile(file_, place.zoom, place.column, place.row, taking, to, message);
    });
  }

  [[nodiscard]] std::string encoding() override {
    const std::string said = text("encoding");
    return said.empty() ? encoding_in_json(text("json")) : said;
  }
  [[nodiscard]] bool says_other_rows() override { return lower_case(text("scheme")) == "xyz"; }

 private:
  /// A value of the metadata; empty where it is not there.
  [[nodiscard]] std::string text(const char* name) const {
    std::vector<std::byte> bytes;
    (void)take(bytes, [&](IsohfMbtilesTake taking, void* to, IsohfMbtilesMessage* message) {
      return module_.text(file_, name, taking, to, message);
    });
    return std::string(text_of(bytes));
  }

  /// The file's size. SQLite takes what is missing of a last page for zeros, and these for an empty page.
  static std::uint64_t whole_pages_bytes(const std::string& path) {
    const RawFile file(path);
    constexpr std::size_t kPageAt = 16;
    std::array<std::byte, kPageAt + 2> head{};
    const bool is_there = file.read_some(0, head) == head.size();
    const unsigned said = std::to_integer<unsigned>(head[kPageAt]) << 8U | std::to_integer<unsigned>(head[kPageAt + 1]);
    const std::uint64_t page = said == 1 ? 65536 : said;
    if (!is_there || page == 0 || file.size_bytes() % page != 0) {
      throw Error(ErrorCode::kCorrupt,
                  fmt::format("{}: ends early: {} bytes, in pages of {}", path, file.size_bytes(), page));
    }
    return file.size_bytes();
  }

  template <typename Call>
  void check(Call call) const {
    IsohfMbtilesMessage message{};
    const int result = call(&message);
    if (result != 0) throw Error(module_error_code(result), fmt::format("{}: {}", path_, message.text));
  }

  /// The bytes that a call hands out; false where there are none.
  template <typename Call>
  [[nodiscard]] bool take(std::vector<std::byte>& bytes, Call call) const {
    struct Taken {
      std::vector<std::byte>* bytes;
      bool is_full;
    } taken{&bytes, false};
    bytes.clear();
    const IsohfMbtilesTake taking = [](void* to, const void* from, std::size_t count) {
      auto& there = *static_cast<Taken*>(to);
      const auto* const first = static_cast<const std::byte*>(from);
      try {
        there.bytes->assign(first, first + count);
      } catch (const std::bad_alloc&) {
        there.is_full = true;
      }
    };
    check([&](IsohfMbtilesMessage* message) { return call(taking, &taken, message); });
    if (taken.is_full) throw std::bad_alloc();
    return !bytes.empty();
  }

  const IsohfMbtilesModule& module_;
  std::string path_;
  IsohfMbtilesFile* file_ = nullptr;
};

}  // namespace

bool looks_like_mbtiles(std::span<const std::byte> head) {
  // Other kinds of databases have numbers of their own there; many MBTiles have none.
  constexpr std::size_t kApplicationAt = 68;
  const std::string_view text = text_of(head);
  if (!text.starts_with(std::string_view("SQLite format 3\0", 16)) || text.size() < kApplicationAt + 4) return false;
  const std::string_view application = text.substr(kApplicationAt, 4);
  return application == "MPBX" || application == std::string_view("\0\0\0\0", 4);
}

std::string mbtiles_library() {
  try {
    return mbtiles_module().library();
  } catch (const Error&) {
    return "the module isohf_mbtiles.so, which is not there";
  }
}

std::unique_ptr<TileStore> open_mbtiles_store(const std::string& path) {
  return std::make_unique<MbtilesStore>(path);
}

}  // namespace isohf
