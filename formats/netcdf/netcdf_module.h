#pragma once

#include <stddef.h>  // NOLINT(modernize-deprecated-headers): the boundary is C
#include <stdint.h>  // NOLINT(modernize-deprecated-headers)

/// The boundary between isohf and the module that reads netCDF-4 through libnetcdf, isohf_netcdf.so. It is loaded only
/// for such a file: libnetcdf brings HDF5, curl and XML. Only C types cross, as in proj_module.h.
///
/// Functions that can fail return 0, or one more than the ErrorCode with a message of one line. One of them runs at a
/// time, whatever the file: HDF5 is not for threads.

extern "C" {

/// Raised whenever anything below changes; the loader refuses any other.
#define ISOHF_NETCDF_ABI 1

typedef struct IsohfNetcdfFile IsohfNetcdfFile;

typedef struct IsohfNetcdfMessage {
  char text[512];
} IsohfNetcdfMessage;

typedef struct IsohfNetcdfCounts {
  int32_t dimensions;
  int32_t variables;
  int32_t attributes;
} IsohfNetcdfCounts;

enum { ISOHF_NETCDF_RANK = 8 };

typedef struct IsohfNetcdfVariable {
  char name[257];
  int32_t type;  ///< as cf_file.h numbers them
  int32_t rank;  ///< variables of more than ISOHF_NETCDF_RANK have 0
  int32_t dimensions[ISOHF_NETCDF_RANK];
  uint64_t chunk[ISOHF_NETCDF_RANK];  ///< 0: it is not stored in chunks
  int32_t attributes;
} IsohfNetcdfVariable;

typedef struct IsohfNetcdfAttribute {
  char name[257];
  int32_t type;
  uint64_t count;  ///< of numbers, or bytes of a text
} IsohfNetcdfAttribute;

typedef int (*IsohfNetcdfOpen)(const char* path, IsohfNetcdfFile** file, IsohfNetcdfCounts* counts,
                               IsohfNetcdfMessage* message);
/// name  at least 257 bytes
typedef int (*IsohfNetcdfDimension)(IsohfNetcdfFile* file, int32_t index, char* name, uint64_t* size,
                                    IsohfNetcdfMessage* message);
typedef int (*IsohfNetcdfDescribe)(IsohfNetcdfFile* file, int32_t index, IsohfNetcdfVariable* variable,
                                   IsohfNetcdfMessage* message);
/// Attributes of a variable, or of the file: -1.
typedef int (*IsohfNetcdfAttributeOf)(IsohfNetcdfFile* file, int32_t variable, int32_t index,
                                      IsohfNetcdfAttribute* attribute, IsohfNetcdfMessage* message);
/// text  `count` bytes, of an attribute that is one; numbers  `count`, of any other
typedef int (*IsohfNetcdfValue)(IsohfNetcdfFile* file, int32_t variable, const IsohfNetcdfAttribute* attribute,
                                char* text, double* numbers, IsohfNetcdfMessage* message);
/// Numbers of a variable of one dimension.
typedef int (*IsohfNetcdfNumbers)(IsohfNetcdfFile* file, int32_t variable, uint64_t first, uint64_t count,
                                  double* numbers, IsohfNetcdfMessage* message);
/// Samples of a box, in the variable's own type and host byte order. start, count  one for each dimension
typedef int (*IsohfNetcdfRead)(IsohfNetcdfFile* file, int32_t variable, const uint64_t* start, const uint64_t* count,
                               void* samples, IsohfNetcdfMessage* message);
/// How much is kept of a variable's chunks.
typedef void (*IsohfNetcdfCache)(IsohfNetcdfFile* file, int32_t variable, uint64_t bytes, uint64_t chunks);
typedef void (*IsohfNetcdfClose)(IsohfNetcdfFile* file);
/// "libnetcdf 4.9.0"; stays valid.
typedef const char* (*IsohfNetcdfLibrary)(void);

typedef struct IsohfNetcdfModule {
  int32_t abi;
  IsohfNetcdfOpen open;
  IsohfNetcdfDimension dimension;
  IsohfNetcdfDescribe describe;
  IsohfNetcdfAttributeOf attribute;
  IsohfNetcdfValue value;
  IsohfNetcdfNumbers numbers;
  IsohfNetcdfRead read;
  IsohfNetcdfCache cache;
  IsohfNetcdfClose close;
  IsohfNetcdfLibrary library;
} IsohfNetcdfModule;

/// The one symbol that the module exports, and its name.
const IsohfNetcdfModule* isohf_netcdf_module(void);
#define ISOHF_NETCDF_SYMBOL "isohf_netcdf_module"
}
