#pragma once

#include <stddef.h>  // NOLINT(modernize-deprecated-headers): the boundary is C
#include <stdint.h>  // NOLINT(modernize-deprecated-headers)

/// The boundary between isohf and the module that reads through OpenImageIO, isohf_oiio.so. It is loaded only for files
/// that no native reader knows, because OpenImageIO brings some hundred libraries with it. Only C types cross: the two
/// sides may be built by different compilers, and no exception passes.
///
/// Every function returns 0, or one more than the ErrorCode with a message of one line, without the path.
/// IsohfOiioOpen returns ISOHF_OIIO_UNKNOWN for files of no format that OpenImageIO knows.

extern "C" {

/// Raised whenever anything below changes; the loader refuses any other.
#define ISOHF_OIIO_ABI 7

#define ISOHF_OIIO_UNKNOWN (-1)

/// As a channel: all of them, interleaved, as the type that holds each.
#define ISOHF_OIIO_ALL_CHANNELS "*"
/// The same of a photo: a picture, whose samples may be spread over the range of their type and rounded.
#define ISOHF_OIIO_PHOTO "*photo"

typedef struct IsohfOiioRaster IsohfOiioRaster;

typedef struct IsohfOiioInfo {
  int64_t width;
  int64_t height;
  int64_t block_width;
  int64_t block_height;
  int32_t sample_type;  ///< a SampleType
  int32_t channels;     ///< that are delivered
  int32_t alpha;        ///< which channel of the file is opacity; -1: none
  int32_t is_linear;    ///< the numbers are light, not coded as sRGB
  char format[32];      ///< "fits", "bmp", ...
  char channel[64];     ///< empty where there is but one
  char warning[256];    ///< empty: none
} IsohfOiioInfo;

typedef struct IsohfOiioMessage {
  char text[512];
} IsohfOiioMessage;

/// Opens `path` and its channel (name or number; empty: the first) and fills `info`.
typedef int (*IsohfOiioOpen)(const char* path, const char* channel, IsohfOiioRaster** raster, IsohfOiioInfo* info,
                             IsohfOiioMessage* message);
/// Reads a window of raw samples in the host's byte order; `bytes` is the size of `samples`.
typedef int (*IsohfOiioRead)(IsohfOiioRaster* raster, int64_t column, int64_t row, int64_t columns, int64_t rows,
                             void* samples, size_t bytes, IsohfOiioMessage* message);
/// Bounds what is kept of decoded samples from one call to the next; the second says what that takes, since a row of
/// blocks is the least. What OpenImageIO keeps itself is not counted.
typedef void (*IsohfOiioBound)(IsohfOiioRaster* raster, int64_t bytes);
typedef int64_t (*IsohfOiioBufferBytes)(const IsohfOiioRaster* raster, int64_t bytes);
typedef void (*IsohfOiioClose)(IsohfOiioRaster* raster);

/// "OpenImageIO 2.4.7", and the extensions of all formats that it reads: "bmp fits ...". Both stay valid.
typedef const char* (*IsohfOiioText)(void);

typedef struct IsohfOiioModule {
  int32_t abi;
  IsohfOiioOpen open;
  IsohfOiioRead read;
  IsohfOiioBound bound;
  IsohfOiioBufferBytes buffer_bytes;
  IsohfOiioClose close;
  IsohfOiioText library;
  IsohfOiioText extensions;
} IsohfOiioModule;

/// The one symbol that the module exports, and its name.
const IsohfOiioModule* isohf_oiio_module(void);
#define ISOHF_OIIO_SYMBOL "isohf_oiio_module"
}
