#pragma once

#include <proj.h>
#include <proj_experimental.h>

#include <memory>
#include <string>

/// What PROJ hands out, held by owners. PROJ's network stays off; its messages are ours to tell.

namespace isohf::proj {

template <auto kFunction>
struct Destroy {
  template <typename T>
  void operator()(T* object) const {
    kFunction(object);
  }
};

using Context = std::unique_ptr<PJ_CONTEXT, Destroy<proj_context_destroy>>;
using Object = std::unique_ptr<PJ, Destroy<proj_destroy>>;

/// For one thread at a time, as everything that is made with it. Throws Error{kOutOfMemory}.
[[nodiscard]] Context make_context();

/// The code of `object` in EPSG's register; 0 where it states none.
[[nodiscard]] int epsg_of(const PJ* object);

/// Text on one line, as PROJ writes it; empty where the dialect cannot say it.
[[nodiscard]] std::string wkt_of(PJ_CONTEXT* context, const PJ* object, PJ_WKT_TYPE dialect);

/// PROJ's, as "Rel. 9.1.1, December 1st, 2022".
[[nodiscard]] std::string release();

/// Degrees in a radian.
inline constexpr double kDegreesPerRadian = 57.295779513082320877;

}  // namespace isohf::proj
