#include "isohf/projection/crs/proj.h"

#include <charconv>
#include <string_view>

#include "isohf/error.h"

namespace isohf::proj {

Context make_context() {
  Context context(proj_context_create());
  if (!context) throw Error(ErrorCode::kOutOfMemory, "PROJ has no memory for a context");
  proj_context_set_enable_network(context.get(), 0);
  // Otherwise they go to standard error, whatever the level.
  proj_log_func(context.get(), nullptr, [](void*, int, const char*) {});
  return context;
}

int epsg_of(const PJ* object) {
  const char* const authority = proj_get_id_auth_name(object, 0);
  if (authority == nullptr || std::string_view(authority) != "EPSG") return 0;
  const std::string_view text = proj_get_id_code(object, 0);
  int code = 0;
  std::from_chars(text.data(), text.data() + text.size(), code);
  return code;
}

std::string wkt_of(PJ_CONTEXT* context, const PJ* object, PJ_WKT_TYPE dialect) {
  const char* const one_line[] = {"MULTILINE=NO", nullptr};
  const char* const text = proj_as_wkt(context, object, dialect, one_line);
  return text != nullptr ? text : "";
}

std::string release() {
  return proj_info().release;
}

}  // namespace isohf::proj
