#pragma once

#include <stddef.h>  // NOLINT(modernize-deprecated-headers): the boundary is C
#include <stdint.h>  // NOLINT(modernize-deprecated-headers)

/// The boundary between isohf and the module that reads MBTiles through SQLite, isohf_mbtiles.so, which is loaded only for
/// such a file. Only C types cross, as in proj_module.h.
///
/// Functions return 0, or one more than the ErrorCode with a message of one line. Rows of tiles are counted from the
/// North, as everywhere in isohf; the file counts them from the South.

extern "C" {

/// Raised whenever anything below changes; the loader refuses any other.
#define ISOHF_MBTILES_ABI 2

typedef struct IsohfMbtilesFile IsohfMbtilesFile;

typedef struct IsohfMbtilesMessage {
  char text[512];
} IsohfMbtilesMessage;

/// bytes  of the file, which bound what its schema may cost
typedef int (*IsohfMbtilesOpen)(const char* path, int64_t bytes, IsohfMbtilesFile** file, IsohfMbtilesMessage* message);
/// The coarsest and finest level with tiles.
typedef int (*IsohfMbtilesZooms)(IsohfMbtilesFile* file, int32_t* first, int32_t* last, IsohfMbtilesMessage* message);
/// box  first and last column, first and last row, column and row of some tile; count  of the tiles: 0, box says nothing
typedef int (*IsohfMbtilesBox)(IsohfMbtilesFile* file, int32_t zoom, int64_t box[6], int64_t* count,
                               IsohfMbtilesMessage* message);
typedef void (*IsohfMbtilesTake)(void* to, const void* bytes, size_t count);
/// Hands the bytes to `take`, which does not throw; without a tile there it is not called. One call at a time, whoever asks.
typedef int (*IsohfMbtilesTile)(IsohfMbtilesFile* file, int32_t zoom, int64_t column, int64_t row,
                                IsohfMbtilesTake take, void* to, IsohfMbtilesMessage* message);
/// The same of the text that the metadata have under a name.
typedef int (*IsohfMbtilesText)(IsohfMbtilesFile* file, const char* name, IsohfMbtilesTake take, void* to,
                                IsohfMbtilesMessage* message);
typedef void (*IsohfMbtilesClose)(IsohfMbtilesFile* file);
/// "SQLite 3.40.1"; stays valid.
typedef const char* (*IsohfMbtilesLibrary)(void);

typedef struct IsohfMbtilesModule {
  int32_t abi;
  IsohfMbtilesOpen open;
  IsohfMbtilesZooms zooms;
  IsohfMbtilesBox box;
  IsohfMbtilesTile tile;
  IsohfMbtilesText text;
  IsohfMbtilesClose close;
  IsohfMbtilesLibrary library;
} IsohfMbtilesModule;

/// The one symbol that the module exports, and its name.
const IsohfMbtilesModule* isohf_mbtiles_module(void);
#define ISOHF_MBTILES_SYMBOL "isohf_mbtiles_module"
}
