#include "isohf/metadata.h"

#include <fmt/format.h>

#include <algorithm>

#include "isohf/error.h"

namespace isohf {

std::string to_string(CodeType type) {
  switch (type) {
    case CodeType::kU16:
      return "u16";
    case CodeType::kU8:
      return "u8";
    case CodeType::kF32:
      return "f32";
  }
  return "unknown";
}

CodeType code_type_from_string(const std::string& text) {
  for (const CodeType type : {CodeType::kU16, CodeType::kU8, CodeType::kF32}) {
    if (text == to_string(type)) return type;
  }
  throw Error(ErrorCode::kInvalidArgument, fmt::format("sample type is \"{}\", must be u16, u8 or f32", text));
}

std::uint32_t metadata_room(const Metadata& draft) {
  constexpr std::size_t kLeast = 16384;
  constexpr std::size_t kStillToCome = 8192;
  const std::size_t wanted = (format_metadata(draft).size() + kStillToCome + 4095) / 4096 * 4096;
  return static_cast<std::uint32_t>(std::clamp<std::size_t>(wanted, kLeast, kMaxMetadataBytes));
}

}  // namespace isohf
