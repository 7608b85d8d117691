#include "isohf/archive/shadow_seeds/shadow_seeds.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "isohf/archive/container/archive_directory.h"
#include "isohf/archive/deflate/deflate.h"
#include "isohf/archive/deflate/deflate_writer.h"
#include "isohf/archive/tile/residuals/bits.h"
#include "isohf/archive/tile/residuals/residual_symbols.h"
#include "isohf/archive/tile/tile_payload.h"
#include "isohf/base/assert.h"
#include "isohf/base/bytes.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr double kNone = -std::numeric_limits<double>::infinity();
constexpr std::uint8_t kSeedsVersion = 1;
constexpr std::size_t kHeaderBytes = 8;

/// The streams of a hull payload.
enum Stream : std::size_t {
  kCounts,        ///< casters of a row, against the row above
  kPlaces,        ///< ordinals, against the predicted caster's or the one before
  kNearHeights,   ///< height against the predicted caster's, where its place was at most one vertex off,
  kOtherHeights,  ///< or a few,
  kFreeHeights,   ///< else against the caster before, nearer to the edge
  kHullStreams
};

/// A caster of the row above stands for the next one of this row until this row has one at most this many vertices
/// nearer to the edge than predicted.
constexpr std::int64_t kPassed = -2;

// --- numbers as symbols in several streams and some bits more ---

/// Collects numbers; small ones cost a symbol alone.
class SymbolWriter {
 public:
  explicit SymbolWriter(std::size_t streams) : streams_(streams) {}

  void put(std::size_t stream, std::uint32_t value);

  /// Appends symbol counts, symbols and bits to the header, and compresses: each stream gets a Huffman table of its
  /// own.
  [[nodiscard]] EncodedSeeds finish(std::vector<std::byte> header);

 private:
  std::vector<std::vector<std::byte>> streams_;
  std::vector<std::byte> extra_;
  std::uint64_t bits_ = 0;
  unsigned bit_count_ = 0;
};

/// Reads them back; everything throws Error{kCorrupt}.
class SymbolReader {
 public:
  /// Takes counts, symbols and bits, which must be all that is left.
  SymbolReader(ByteReader& reader, std::size_t streams);

  [[nodiscard]] std::uint32_t get(std::size_t stream);
  /// Symbols that the stream still has.
  [[nodiscard]] std::uint64_t left(std::size_t stream) const { return streams_[stream].size() - next_[stream]; }
  /// Everything must have been read.
  void finish() const;

 private:
  std::vector<std::span<const std::byte>> streams_;
  std::vector<std::size_t> next_;
  std::optional<BitReader> extra_;
};

void SymbolWriter::put(std::size_t stream, std::uint32_t value) {
  const unsigned symbol = symbol_of(value);
  streams_[stream].push_back(static_cast<std::byte>(symbol));
  const unsigned count = extra_bits_of_symbol(symbol);
  bits_ |= (value & ((std::uint64_t{1} << count) - 1)) << bit_count_;
  bit_count_ += count;
  for (; bit_count_ >= 8; bit_count_ -= 8, bits_ >>= 8U) extra_.push_back(static_cast<std::byte>(bits_ & 0xffU));
}

EncodedSeeds SymbolWriter::finish(std::vector<std::byte> header) {
  if (bit_count_ > 0) extra_.push_back(static_cast<std::byte>(bits_));
  std::vector<std::byte> payload = std::move(header);
  ByteWriter writer(payload);
  for (const auto& stream : streams_) writer.write(static_cast<std::uint32_t>(stream.size()));
  writer.write(static_cast<std::uint32_t>(extra_.size()));

  EncodedSeeds out;
  DeflateWriter deflate(out.deflated);
  std::uint32_t crc = crc32(payload);
  deflate.add(payload);
  streams_.push_back(std::move(extra_));
  std::size_t bytes = payload.size();
  for (const auto& stream : streams_) {
    bytes += stream.size();
    crc = crc32(stream, crc);
    if (!stream.empty()) deflate.add(stream);
  }
  deflate.finish();
  out.payload_bytes = static_cast<std::uint32_t>(bytes);
  out.payload_crc32 = crc;
  return out;
}

SymbolReader::SymbolReader(ByteReader& reader, std::size_t streams) : next_(streams, 0) {
  std::vector<std::uint32_t> counts(streams);
  for (auto& count : counts) count = reader.read<std::uint32_t>();
  const auto extra_bytes = reader.read<std::uint32_t>();
  for (const std::uint32_t count : counts) streams_.push_back(reader.read_bytes(count));
  extra_.emplace(reader.read_bytes(extra_bytes));
  if (reader.remaining() != 0) {
    throw Error(ErrorCode::kCorrupt, fmt::format("{} bytes follow the last stream", reader.remaining()));
  }
}

std::uint32_t SymbolReader::get(std::size_t stream) {
  if (left(stream) == 0) throw Error(ErrorCode::kCorrupt, fmt::format("stream {} ends early", stream));
  const auto symbol = static_cast<unsigned>(streams_[stream][next_[stream]++]);
  if (symbol >= symbol_limit(32)) throw Error(ErrorCode::kCorrupt, fmt::format("{} is no symbol", symbol));
  const std::uint32_t extra = extra_->take(extra_bits_of_symbol(symbol));
  if (extra_->ran_out()) throw Error(ErrorCode::kCorrupt, "the extra bits end early");
  return zigzagged_from(symbol, extra);
}

void SymbolReader::finish() const {
  for (std::size_t stream = 0; stream < streams_.size(); ++stream) {
    if (left(stream) != 0) {
      throw Error(ErrorCode::kCorrupt, fmt::format("stream {} has {} symbols too many", stream, left(stream)));
    }
  }
  if (!extra_->is_used_up()) throw Error(ErrorCode::kCorrupt, "extra bits are left");
}

// --- heights and casters ---

/// Heights as whole numbers that keep their order: codes, or a float's place among all floats.
std::int32_t whole_from_height(CodeType type, double height) {
  if (type == CodeType::kF32) return ordered_from_float(static_cast<float>(height), 0);
  return static_cast<std::int32_t>(height);
}

double height_from_whole(CodeType type, std::int32_t whole) {
  if (type == CodeType::kF32) return static_cast<double>(float_from_ordered(whole, 0));
  return whole;
}

/// What a row's heights are coded on: the padding at that edge; where it is void what is below all others.
std::int32_t edge_of(const TileEdges& edges, int row, LightTravel travel) {
  const double height = (travel == LightTravel::kEastward ? edges.west : edges.east)[static_cast<std::size_t>(row - 1)];
  if (!std::isnan(height)) return whole_from_height(edges.type, height);
  return edges.type == CodeType::kF32 ? ordered_from_float(-std::numeric_limits<float>::infinity(), 0) : -1;
}

/// Differences wrap around, so that the two ends of the floats fit as well.
std::uint32_t minus(std::int32_t a, std::int32_t b) {
  return static_cast<std::uint32_t>(a) - static_cast<std::uint32_t>(b);
}
std::int32_t plus(std::int32_t a, std::uint32_t difference) {
  return static_cast<std::int32_t>(static_cast<std::uint32_t>(a) + difference);
}

/// The ordinal in a row of the vertex nearest to a distance that a neighbouring row has, the farther one of two.
std::int64_t nearest_ordinal(const TileShape& shape, int row, std::int64_t distance) {
  const std::int64_t across = half_steps_across(shape);
  if (row % 2 != 0) return (distance + 1) / 2;
  return distance / across * (shape.cell_columns() + 1) + (distance % across + 1) / 2;
}

/// Goes through a row's casters beside those of the row above and says what each is predicted from. Encoder and decoder
/// take the same steps.
class CasterPrediction {
 public:
  CasterPrediction(const TileShape& shape, CodeType type, int row, std::int32_t edge,
                   std::span<const ShadowCaster> above)
      : shape_(shape), type_(type), row_(row), above_(above), whole_(edge) {
    skip_passed();
  }

  [[nodiscard]] bool has_above() const { return next_ < above_.size(); }
  /// Base of the next caster's ordinal: that of the caster above, else the first that is possible.
  [[nodiscard]] std::int64_t place() const { return has_above() ? above_place() : place_ + 1; }
  /// The stream that its height stands in, and the height that it is coded on.
  [[nodiscard]] Stream height_stream(std::int64_t place) const {
    if (!has_above()) return kFreeHeights;
    const std::int64_t off = std::abs(place - above_place());
    return off <= 1 ? kNearHeights : off <= 6 ? kOtherHeights : kFreeHeights;
  }
  [[nodiscard]] std::int32_t whole(Stream stream) const {
    return stream == kFreeHeights ? whole_ : whole_from_height(type_, above_[next_].height);
  }
  [[nodiscard]] std::int64_t previous_place() const { return place_; }

  void take(std::int64_t place, std::int32_t whole) {
    if (has_above() && place - above_place() >= kPassed) ++next_;
    place_ = place;
    whole_ = whole;
    skip_passed();
  }

 private:
  [[nodiscard]] std::int64_t above_place() const { return nearest_ordinal(shape_, row_, above_[next_].distance); }
  void skip_passed() {
    while (has_above() && above_place() <= place_) ++next_;
  }

  const TileShape& shape_;
  CodeType type_;
  int row_;
  std::span<const ShadowCaster> above_;
  std::size_t next_ = 0;
  std::int64_t place_ = 1;  ///< the padding's
  std::int32_t whole_;
};

std::span<const ShadowCaster> row_above(const CasterRows& rows, int row) {
  return row == 1 ? std::span<const ShadowCaster>() : rows.row(row - 1);
}

void encode_direction(const TileGrid& grid, const TileEdges& edges, LightTravel travel, const CasterRows& rows,
                      SymbolWriter& writer) {
  const TileShape& shape = grid.shape();
  for (int row = 1; row <= visible_rows(shape); ++row) {
    const auto above = row_above(rows, row);
    const auto casters = rows.row(row);
    writer.put(kCounts, zigzag(static_cast<std::int32_t>(casters.size()) - static_cast<std::int32_t>(above.size())));
    CasterPrediction prediction(shape, edges.type, row, edge_of(edges, row, travel), above);
    for (const ShadowCaster& caster : casters) {
      const std::int64_t place = ordinal_from_distance(shape, row, caster.distance);
      ISOHF_ASSERT(place > prediction.previous_place());
      const std::int32_t whole = whole_from_height(edges.type, caster.height);
      const Stream stream = prediction.height_stream(place);
      writer.put(kPlaces, zigzag(static_cast<std::int32_t>(place - prediction.place())));
      const std::uint32_t off = minus(whole, prediction.whole(stream));
      writer.put(stream, stream == kFreeHeights ? off : zigzag(static_cast<std::int32_t>(off)));
      prediction.take(place, whole);
    }
  }
}

[[noreturn]] void refuse(const std::string& why) {
  throw Error(ErrorCode::kCorrupt, why);
}

void check_height(CodeType type, std::int32_t whole, int row) {
  const double height = height_from_whole(type, whole);
  const double highest = type == CodeType::kU8    ? 254
                         : type == CodeType::kU16 ? 65534
                                                  : double{std::numeric_limits<float>::max()};
  const double lowest = type == CodeType::kF32 ? -highest : 0.0;
  if (!(height >= lowest && height <= highest)) refuse(fmt::format("row {}: a caster's height is no elevation", row));
}

/// `most` vertices lie before the edge.
CasterRows decode_direction(const TileGrid& grid, const TileEdges& edges, LightTravel travel, std::int64_t most,
                            SymbolReader& reader) {
  const TileShape& shape = grid.shape();
  CasterRows rows;
  rows.starts.push_back(0);
  for (int row = 1; row <= visible_rows(shape); ++row) {
    // A copy: the list grows while the row is read.
    const auto before = row_above(rows, row);
    const std::vector<ShadowCaster> above(before.begin(), before.end());
    const auto count =
        static_cast<std::int64_t>(above.size()) + static_cast<std::int32_t>(unzigzag(reader.get(kCounts)));
    if (count < 0 || static_cast<std::uint64_t>(count) > reader.left(kPlaces)) {
      refuse(fmt::format("row {}: states {} casters, {} are left", row, count, reader.left(kPlaces)));
    }
    CasterPrediction prediction(shape, edges.type, row, edge_of(edges, row, travel), above);
    for (std::int64_t i = 0; i < count; ++i) {
      const std::int64_t place = prediction.place() + static_cast<std::int32_t>(unzigzag(reader.get(kPlaces)));
      if (place <= prediction.previous_place() || place > most) {
        refuse(fmt::format("row {}: a caster is vertex {} from the edge, must lie from {} to {}", row, place,
                           prediction.previous_place() + 1, most));
      }
      const Stream stream = prediction.height_stream(place);
      const std::uint32_t folded = reader.get(stream);
      const std::int32_t whole = plus(prediction.whole(stream), stream == kFreeHeights ? folded : unzigzag(folded));
      check_height(edges.type, whole, row);
      rows.casters.push_back({distance_from_ordinal(shape, row, place), height_from_whole(edges.type, whole)});
      prediction.take(place, whole);
    }
    rows.starts.push_back(static_cast<std::uint32_t>(rows.casters.size()));
  }
  return rows;
}

std::vector<std::byte> start_payload(const TileShape& shape, CodeType type) {
  std::vector<std::byte> payload;
  ByteWriter writer(payload);
  writer.write(kSeedsVersion);
  writer.write(std::uint8_t{0});
  writer.write(static_cast<std::uint8_t>(type));
  writer.write(std::uint8_t{0});
  writer.write(static_cast<std::uint16_t>(visible_rows(shape)));
  writer.write(std::uint16_t{0});
  ISOHF_ASSERT(payload.size() == kHeaderBytes);
  return payload;
}

void read_header(const TileShape& shape, CodeType type, ByteReader& reader) {
  const auto version = reader.read<std::uint8_t>();
  if (version != kSeedsVersion) {
    throw Error(ErrorCode::kUnsupported, fmt::format("version {} of seeds, {} is read", version, kSeedsVersion));
  }
  const auto expect = [&](const char* what, std::uint64_t found, std::uint64_t wanted) {
    if (found != wanted) refuse(fmt::format("{} is {}, must be {}", what, found, wanted));
  };
  expect("the kind", reader.read<std::uint8_t>(), 0);
  expect("the code type", reader.read<std::uint8_t>(), static_cast<std::uint64_t>(type));
  expect("the reserved byte", reader.read<std::uint8_t>(), 0);
  expect("the number of rows", reader.read<std::uint16_t>(), static_cast<std::uint64_t>(visible_rows(shape)));
  expect("the reserved number", reader.read<std::uint16_t>(), 0);
}

}  // namespace

TileEdges tile_edges(const TileShape& shape, const TileCodes& tile) {
  TileEdges edges;
  edges.type = tile.type;
  const auto void_code = tile.type == CodeType::kU8 ? 255 : 65535;
  for (int row = 1; row <= visible_rows(shape); ++row) {
    for (const int column : {0, last_visible_column(shape, row) + 1}) {
      const auto at =
          static_cast<std::size_t>(row) * static_cast<std::size_t>(shape.columns()) + static_cast<std::size_t>(column);
      double height = NAN;
      if (tile.type == CodeType::kF32) {
        if (std::isfinite(tile.heights[at])) height = static_cast<double>(tile.heights[at]);
      } else if (tile.codes[at] != void_code) {
        height = tile.codes[at];
      }
      (column == 0 ? edges.west : edges.east).push_back(height);
    }
  }
  return edges;
}

bool has_room_for_seeds(const TileGrid& grid) {
  return grid.tile_columns() < (std::int64_t{1} << 31) / (grid.shape().cell_columns() + 1);
}

EncodedSeeds encode_seeds(const TileGrid& grid, const TileEdges& edges, const HullSeeds& seeds) {
  ISOHF_ASSERT(has_room_for_seeds(grid));
  SymbolWriter writer(kHullStreams);
  encode_direction(grid, edges, LightTravel::kEastward, seeds.eastward, writer);
  encode_direction(grid, edges, LightTravel::kWestward, seeds.westward, writer);
  return writer.finish(start_payload(grid.shape(), edges.type));
}

HullSeeds decode_hull_seeds(const TileGrid& grid, TileIndex index, const TileEdges& edges,
                            std::span<const std::byte> payload) {
  ByteReader bytes(payload);
  read_header(grid.shape(), edges.type, bytes);
  SymbolReader reader(bytes, kHullStreams);
  // Even rows have a vertex more for each tile; a limit that holds for both keeps casters inside the heightfield.
  const std::int64_t steps = grid.shape().cell_columns() + 1;
  HullSeeds seeds;
  seeds.eastward = decode_direction(grid, edges, LightTravel::kEastward, index.column * steps, reader);
  seeds.westward =
      decode_direction(grid, edges, LightTravel::kWestward, (grid.tile_columns() - 1 - index.column) * steps, reader);
  reader.finish();
  return seeds;
}

std::string seed_name(TileIndex tile) {
  return fmt::format("seeds/{}/{}.seed", tile.row, tile.column);
}

std::optional<TileIndex> tile_from_seed_name(std::string_view name) {
  constexpr std::string_view kFolder = "seeds/";
  constexpr std::string_view kEnding = ".seed";
  if (name.size() < kFolder.size() + kEnding.size() || !name.starts_with(kFolder) || !name.ends_with(kEnding)) {
    return std::nullopt;
  }
  const auto middle = name.substr(kFolder.size(), name.size() - kFolder.size() - kEnding.size());
  const auto found = tile_from_name(fmt::format("tiles/{}.tile", middle));
  return found ? std::optional(found->tile) : std::nullopt;
}

}  // namespace isohf
