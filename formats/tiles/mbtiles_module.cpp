#include "formats/tiles/mbtiles_module.h"

#include <sqlite3.h>

#include <algorithm>
#include <array>
#include <initializer_list>
#include <memory>
#include <mutex>
#include <string>
#include <string_view>

#include "formats/module_inside.h"
#include "isohf/error.h"

// The module is a library of its own: it shares headers with isohf, no code.

struct IsohfMbtilesFile {
  ~IsohfMbtilesFile() {
    sqlite3_finalize(tile);
    sqlite3_close(database);
  }
  sqlite3* database = nullptr;
  sqlite3_stmt* tile = nullptr;
  int64_t bytes = 0;  ///< of the file
  int64_t steps = 0;  ///< that a question may still take
  std::mutex one_at_a_time;
};

namespace {

using isohf::Error;
using isohf::ErrorCode;

constexpr int kMostZoom = 30;
/// Of a tile or text.
constexpr int kMostBytes = 1 << 26;
/// What SQLite may hold in the whole process, beside two tiles: views of views grow in it as they are put together.
constexpr int64_t kHeldBytes = int64_t{1} << 25;
/// SQLite's steps for a question: some ten for each tile that it looks at, which has a row of tens of bytes; a million take
/// some hundredths of a second.
constexpr int64_t kLeastSteps = 2'000'000;
constexpr int64_t kStepsOfAByte = 8;
constexpr int kStepsAtOnce = 1000;

/// No recursion, and no functions that make long texts: views of tiles join, choose and count.
int allow(void* /*unused*/, int action, const char* /*unused*/, const char* function, const char* /*unused*/,
          const char* /*unused*/) {
  static constexpr std::array<std::string_view, 12> kFunctions = {
      "min", "max", "count", "coalesce", "ifnull", "nullif", "abs", "round", "length", "typeof", "sum", "iif"};
  if (action == SQLITE_RECURSIVE) return SQLITE_DENY;
  if (action != SQLITE_FUNCTION || function == nullptr) return SQLITE_OK;
  return std::find(kFunctions.begin(), kFunctions.end(), function) != kFunctions.end() ? SQLITE_OK : SQLITE_DENY;
}

[[noreturn]] void fail(sqlite3* database, int status) {
  const int kind = status & 0xFF;
  const bool is_full = kind == SQLITE_NOMEM;
  const bool is_refused = kind == SQLITE_INTERRUPT || kind == SQLITE_AUTH;
  const ErrorCode code = is_full                                                       ? ErrorCode::kOutOfMemory
                         : kind == SQLITE_CORRUPT || kind == SQLITE_NOTADB             ? ErrorCode::kCorrupt
                         : kind == SQLITE_ERROR || kind == SQLITE_TOOBIG || is_refused ? ErrorCode::kUnsupported
                                                                                       : ErrorCode::kIo;
  std::string text = std::string("SQLite says: ") + sqlite3_errmsg(database);
  if (kind == SQLITE_ERROR) text = "is an SQLite database, but none of tiles (MBTiles); " + text;
  if (is_refused || is_full) {
    text = "its schema makes more work of a question than tiles do (sqlite3 FILE .schema shows it)";
    if (kind != SQLITE_INTERRUPT) text += std::string("; SQLite says: ") + sqlite3_errmsg(database);
  }
  if (kind == SQLITE_READONLY || kind == SQLITE_CANTOPEN || kind == SQLITE_BUSY) {
    text += "; sqlite3 FILE 'PRAGMA journal_mode=DELETE' ends what a program has left open";
  }
  throw Error(code, text);
}

/// A statement, and the numbers that it is about.
class Query {
 public:
  Query(sqlite3* database, const char* text, std::initializer_list<int64_t> numbers) : database_(database) {
    if (const int status = sqlite3_prepare_v2(database, text, -1, &statement_, nullptr); status != SQLITE_OK) {
      fail(database, status);
    }
    int at = 0;
    for (const int64_t number : numbers) sqlite3_bind_int64(statement_, ++at, number);
  }
  Query(const Query&) = delete;
  Query& operator=(const Query&) = delete;
  ~Query() { sqlite3_finalize(statement_); }

  [[nodiscard]] bool step() {
    const int status = sqlite3_step(statement_);
    if (status != SQLITE_ROW && status != SQLITE_DONE) fail(database_, status);
    return status == SQLITE_ROW;
  }
  [[nodiscard]] int64_t number(int column) { return sqlite3_column_int64(statement_, column); }
  [[nodiscard]] bool is_null(int column) { return sqlite3_column_type(statement_, column) == SQLITE_NULL; }
  [[nodiscard]] sqlite3_stmt* get() { return statement_; }

 private:
  sqlite3* database_;
  sqlite3_stmt* statement_ = nullptr;
};

template <typename Action>
int call(IsohfMbtilesFile* file, IsohfMbtilesMessage* message, Action action) {
  const std::lock_guard lock(file->one_at_a_time);
  file->steps = kLeastSteps + kStepsOfAByte * file->bytes;
  return isohf::guarded(message, "SQLite", ErrorCode::kCorrupt, action);
}

int open_file(const char* path, int64_t size, IsohfMbtilesFile** out, IsohfMbtilesMessage* message) {
  return isohf::guarded(message, "SQLite", ErrorCode::kCorrupt, [&] {
    auto file = std::make_unique<IsohfMbtilesFile>();
    const int status = sqlite3_open_v2(path, &file->database, SQLITE_OPEN_READONLY | SQLITE_OPEN_NOMUTEX, nullptr);
    if (status != SQLITE_OK) fail(file->database, status);
    file->bytes = size;
    // A view may make rows and texts out of nothing: both are bounded by what the file could hold.
    constexpr int64_t kAlways = 1 << 14;
    const int64_t longest = std::clamp<int64_t>(size, kAlways, kMostBytes);
    sqlite3_limit(file->database, SQLITE_LIMIT_LENGTH, static_cast<int>(longest));
    sqlite3_set_authorizer(file->database, allow, nullptr);
    sqlite3_hard_heap_limit64(std::max<int64_t>(sqlite3_hard_heap_limit64(-1), kHeldBytes + 2 * longest));
    file->steps = kLeastSteps;
    sqlite3_progress_handler(
        file->database, kStepsAtOnce,
        [](void* of) { return (static_cast<IsohfMbtilesFile*>(of)->steps -= kStepsAtOnce) < 0 ? 1 : 0; }, file.get());
    // Nothing of what a schema may ask for runs.
    sqlite3_db_config(file->database, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    sqlite3_db_config(file->database, SQLITE_DBCONFIG_DEFENSIVE, 1, nullptr);
    const char* const text = "SELECT tile_data FROM tiles WHERE zoom_level = ?1 AND tile_column = ?2 AND tile_row = ?3";
    const int made = sqlite3_prepare_v2(file->database, text, -1, &file->tile, nullptr);
    if (made != SQLITE_OK) fail(file->database, made);
    *out = file.release();
  });
}

int zooms(IsohfMbtilesFile* file, int32_t* first, int32_t* last, IsohfMbtilesMessage* message) {
  return call(file, message, [&] {
    Query query(file->database, "SELECT min(zoom_level), max(zoom_level) FROM tiles", {});
    if (!query.step() || query.is_null(0)) throw Error(ErrorCode::kUnsupported, "holds no tiles");
    if (query.number(0) < 0 || query.number(1) > kMostZoom) {
      throw Error(ErrorCode::kCorrupt, "says zoom levels " + std::to_string(query.number(0)) + " to " +
                                           std::to_string(query.number(1)) + ", must be from 0 to 30");
    }
    *first = static_cast<int32_t>(query.number(0));
    *last = static_cast<int32_t>(query.number(1));
  });
}

int box_of(IsohfMbtilesFile* file, int32_t zoom, int64_t box[6], int64_t* count, IsohfMbtilesMessage* message) {
  return call(file, message, [&] {
    Query query(file->database,
                "SELECT min(tile_column), max(tile_column), min(tile_row), max(tile_row), count(*) FROM tiles WHERE "
                "zoom_level = ?1",
                {zoom});
    *count = query.step() ? query.number(4) : 0;
    if (*count == 0) return;
    const int64_t most = (int64_t{1} << zoom) - 1;
    for (int at = 0; at < 4; ++at) {
      if (query.number(at) < 0 || query.number(at) > most) {
        throw Error(ErrorCode::kCorrupt, "says a column or row " + std::to_string(query.number(at)) + " of level " +
                                             std::to_string(zoom) + ", must be from 0 to " + std::to_string(most));
      }
    }
    box[0] = query.number(0);
    box[1] = query.number(1);
    box[2] = most - query.number(3);
    box[3] = most - query.number(2);
    Query any(file->database, "SELECT tile_column, tile_row FROM tiles WHERE zoom_level = ?1 LIMIT 1", {zoom});
    if (!any.step()) throw Error(ErrorCode::kCorrupt, "its index and its table differ");
    box[4] = any.number(0);
    box[5] = most - any.number(1);
  });
}

int tile(IsohfMbtilesFile* file, int32_t zoom, int64_t column, int64_t row, IsohfMbtilesTake take, void* to,
         IsohfMbtilesMessage* message) {
  return call(file, message, [&] {
    sqlite3_reset(file->tile);
    sqlite3_bind_int64(file->tile, 1, zoom);
    sqlite3_bind_int64(file->tile, 2, column);
    sqlite3_bind_int64(file->tile, 3, (int64_t{1} << zoom) - 1 - row);
    const int status = sqlite3_step(file->tile);
    if (status == SQLITE_ROW) {
      const void* const bytes = sqlite3_column_blob(file->tile, 0);
      const int count = sqlite3_column_bytes(file->tile, 0);
      if (bytes != nullptr && count > 0) take(to, bytes, static_cast<size_t>(count));
    }
    sqlite3_reset(file->tile);
    if (status != SQLITE_ROW && status != SQLITE_DONE) fail(file->database, status);
  });
}

int text_of(IsohfMbtilesFile* file, const char* name, IsohfMbtilesTake take, void* to, IsohfMbtilesMessage* message) {
  return call(file, message, [&] {
    // Files without this table are read as well.
    sqlite3_stmt* statement = nullptr;
    if (sqlite3_prepare_v2(file->database, "SELECT value FROM metadata WHERE name = ?1", -1, &statement, nullptr) ==
        SQLITE_OK) {
      sqlite3_bind_text(statement, 1, name, -1, SQLITE_STATIC);
      if (sqlite3_step(statement) == SQLITE_ROW) {
        const void* const bytes = sqlite3_column_text(statement, 0);
        if (bytes != nullptr) take(to, bytes, static_cast<size_t>(sqlite3_column_bytes(statement, 0)));
      }
    }
    sqlite3_finalize(statement);
  });
}

void close_file(IsohfMbtilesFile* file) {
  delete file;
}

const char* library() {
  static const std::string name = std::string("SQLite ") + sqlite3_libversion();
  return name.c_str();
}

}  // namespace

extern "C" __attribute__((visibility("default"))) const IsohfMbtilesModule* isohf_mbtiles_module(void) {
  static const IsohfMbtilesModule module = {ISOHF_MBTILES_ABI, open_file,  zooms,  box_of, tile,
                                            text_of,           close_file, library};
  return &module;
}
