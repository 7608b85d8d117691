#include "isohf/raster.h"

#include <array>
#include <bit>
#include <utility>

#include "isohf/error.h"
#include "isohf/surface/source/sample_types.h"

namespace isohf {
namespace {

constexpr std::array<std::pair<SampleType, const char*>, 9> kSampleTypeNames = {{
    {SampleType::kUint8, "uint8"},
    {SampleType::kInt8, "int8"},
    {SampleType::kUint16, "uint16"},
    {SampleType::kInt16, "int16"},
    {SampleType::kUint32, "uint32"},
    {SampleType::kInt32, "int32"},
    {SampleType::kFloat16, "float16"},
    {SampleType::kFloat32, "float32"},
    {SampleType::kFloat64, "float64"},
}};

}  // namespace

std::size_t size_bytes(SampleType type) {
  switch (type) {
    case SampleType::kUint8:
    case SampleType::kInt8:
      return 1;
    case SampleType::kUint16:
    case SampleType::kInt16:
    case SampleType::kFloat16:
      return 2;
    case SampleType::kUint32:
    case SampleType::kInt32:
    case SampleType::kFloat32:
      return 4;
    case SampleType::kFloat64:
      return 8;
  }
  return 0;
}

std::string to_string(SampleType type) {
  for (const auto& [known, name] : kSampleTypeNames) {
    if (known == type) return name;
  }
  return {};
}

SampleType sample_type_from_string(const std::string& text) {
  for (const auto& [type, name] : kSampleTypeNames) {
    if (text == name) return type;
  }
  throw Error(ErrorCode::kInvalidArgument,
              "sample type is \"" + text +
                  "\", must be uint8, int8, uint16, int16, uint32, int32, float16, float32 or float64");
}

bool is_floating(SampleType type) {
  return type == SampleType::kFloat16 || type == SampleType::kFloat32 || type == SampleType::kFloat64;
}

std::string to_string(Registration registration) {
  switch (registration) {
    case Registration::kArea:
      return "area";
    case Registration::kPoint:
      return "point";
    case Registration::kUnknown:
      break;
  }
  return "unknown";
}

float float_from_half(std::uint16_t bits) {
  const std::uint32_t sign = std::uint32_t{bits & 0x8000U} << 16U;
  const std::uint32_t exponent = (bits >> 10U) & 0x1FU;
  const std::uint32_t mantissa = bits & 0x3FFU;
  if (exponent == 0x1FU) return std::bit_cast<float>(sign | 0x7F800000U | (mantissa << 13U));
  if (exponent != 0U) return std::bit_cast<float>(sign | ((exponent + 112U) << 23U) | (mantissa << 13U));
  // Zero and subnormals: mantissa * 2^-24, exact in single precision.
  const float magnitude = static_cast<float>(mantissa) * 0x1p-24F;
  return sign != 0U ? -magnitude : magnitude;
}

}  // namespace isohf
