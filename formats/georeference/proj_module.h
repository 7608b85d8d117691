#pragma once

#include <stddef.h>  // NOLINT(modernize-deprecated-headers): the boundary is C
#include <stdint.h>  // NOLINT(modernize-deprecated-headers)

/// The boundary between isohf and the module that understands reference systems through PROJ, isohf_proj.so. It is
/// loaded only where a system has to be understood: PROJ brings a database and some twenty libraries with it. Only C
/// types cross, as in oiio_module.h. The network stays off.
///
/// Functions that can fail return 0, or one more than the ErrorCode with a message of one line.

extern "C" {

/// Raised whenever anything below changes; the loader refuses any other.
#define ISOHF_PROJ_ABI 5

typedef struct IsohfProjSystem IsohfProjSystem;

/// The dialects of well-known text that systems are written in.
enum { ISOHF_WKT2 = 0, ISOHF_WKT1 = 1, ISOHF_WKT_ESRI = 2, ISOHF_WKTS = 3 };

/// What heights are called that are the third coordinate of longitudes and latitudes, or of a map.
#define ISOHF_ELLIPSOIDAL_HEIGHT "the ellipsoid"

/// The horizontal part of a system, and what it says of heights.
typedef struct IsohfProjInfo {
  char name[256];          ///< "WGS 84 / UTM zone 32N"
  char authority[32];      ///< "EPSG", "ESRI", "IAU_2015", ...; empty where the text gives none
  char code[32];           ///< "32632"
  char datum[256];         ///< "World Geodetic System 1984", or of the geographic system where it has but an ensemble
  int32_t is_projected;    ///< 0: longitudes and latitudes
  int32_t is_compound;     ///< heights belong to it
  double metres_per_unit;  ///< of both axes; degrees in a unit where not projected
  double semi_major_axis_m;
  double inverse_flattening;  ///< 0 for a sphere
  double prime_meridian_deg;  ///< East of Greenwich: where its longitudes are counted from
  char vertical_name[256];  ///< "NAVD88 height (ftUS)", or ISOHF_ELLIPSOIDAL_HEIGHT; empty: nothing is said of heights
  int32_t vertical_epsg;    ///< its code; 0: none
  char vertical_unit[64];   ///< "US survey foot"
  double metres_per_vertical_unit;  ///< negative: depths
  size_t wkt_bytes[ISOHF_WKTS];     ///< of each dialect, with the 0 behind it; 1 where it cannot say the system
} IsohfProjInfo;

typedef struct IsohfProjMessage {
  char text[512];
} IsohfProjMessage;

/// A way from the longitudes and latitudes of one system to the coordinates of another.
typedef struct IsohfProjOperation {
  char pipeline[4096];  ///< PROJ's: degrees from Greenwich -> coordinates, East before North
  int32_t is_ballpark;  ///< no relation of the datums is known: they are taken for one
} IsohfProjOperation;

typedef struct IsohfProjText {
  char text[8192];
} IsohfProjText;

/// Understands `text`: "EPSG:2154", WKT of any version and dialect, a PROJ string, PROJJSON. `vertical`, where it is not
/// empty, is the system of the heights of a `text` that says nothing of them.
typedef int (*IsohfProjOpen)(const char* text, const char* vertical, IsohfProjSystem** system, IsohfProjInfo* info,
                             IsohfProjMessage* message);
/// The best way, over a ground of West, South, East, North in degrees, from the longitudes and latitudes of the system
/// `from` to the system `to`, of those that need no grid that is not installed.
typedef int (*IsohfProjFindOperation)(const char* from, const char* to, const double* ground,
                                      IsohfProjOperation* operation, IsohfProjMessage* message);
/// The projection of the projected system `map` on the body of the system `body`, as WKT2 called `name`.
typedef int (*IsohfProjOnBody)(const char* map, const char* body, const char* name, IsohfProjText* wkt,
                               IsohfProjMessage* message);
/// Such a pipeline again, as a system that can be moved by and closed, and nothing else.
typedef int (*IsohfProjOpenPipeline)(const char* pipeline, IsohfProjSystem** system, IsohfProjMessage* message);
/// The text of all of the system, on one line: WKT2 (ISO 19162:2019), WKT1 as GDAL writes it, ESRI's WKT1.
/// `wkt` holds `wkt_bytes`.
typedef void (*IsohfProjWkt)(const IsohfProjSystem* system, int dialect, char* wkt);
/// Whether both are one system, however they are spelled and named.
typedef int (*IsohfProjSame)(const IsohfProjSystem* a, const IsohfProjSystem* b);
/// Coordinates of the system, East before North and in its units, to degrees from Greenwich, and back, in place: x and
/// y of `count` places. NaN where there is no such place. Any number of threads at once.
typedef void (*IsohfProjMove)(const IsohfProjSystem* system, double* places, size_t count);
typedef void (*IsohfProjClose)(IsohfProjSystem* system);
/// "PROJ 9.1.1"; stays valid.
typedef const char* (*IsohfProjVersion)(void);

typedef struct IsohfProjModule {
  int32_t abi;
  IsohfProjOpen open;
  IsohfProjFindOperation find_operation;
  IsohfProjOnBody on_body;
  IsohfProjOpenPipeline open_pipeline;
  IsohfProjWkt wkt;
  IsohfProjSame same;
  IsohfProjMove to_geo;
  IsohfProjMove from_geo;
  IsohfProjClose close;
  IsohfProjVersion library;
} IsohfProjModule;

/// The one symbol that the module exports, and its name.
const IsohfProjModule* isohf_proj_module(void);
#define ISOHF_PROJ_SYMBOL "isohf_proj_module"
}
