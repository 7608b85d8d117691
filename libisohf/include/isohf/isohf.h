// SPDX-License-Identifier: Apache-2.0
#pragma once

/// The whole library: a raster is opened, converted, and its archive read, sampled and verified (docs/library.md).

#include "isohf/archive.h"
#include "isohf/byte_source.h"
#include "isohf/convert.h"
#include "isohf/error.h"
#include "isohf/job.h"
#include "isohf/lattice.h"
#include "isohf/mesh.h"
#include "isohf/metadata.h"
#include "isohf/parts.h"
#include "isohf/picture.h"
#include "isohf/projection.h"
#include "isohf/raster.h"
#include "isohf/resampling.h"
#include "isohf/shade.h"
#include "isohf/shards.h"
#include "isohf/surface.h"
#include "isohf/tile_range.h"
#include "isohf/verify.h"
