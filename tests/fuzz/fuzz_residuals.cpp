// Any bytes are residuals of a few samples, or places of samples, or an error; samples that were read are coded and read
// back the same. The first two bytes choose sample type and width.

#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>
#include <vector>

#include "isohf/error.h"
#include "isohf/restore/lossless.h"
#include "isohf/restore/predict/place_mesh.h"
#include "isohf/restore/residual_codec.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using isohf::SampleType;
  if (size < 2) return 0;
  constexpr std::array kTypes = {SampleType::kUint8,   SampleType::kInt16,   SampleType::kUint16, SampleType::kInt32,
                                 SampleType::kFloat16, SampleType::kFloat32, SampleType::kFloat64};
  const isohf::SampleMapping mapping{kTypes[data[0] % kTypes.size()], data[0] < 128 ? 1.0 : -0.25, 3.5};
  const std::int64_t width = 1 + data[1] % 12;
  const auto payload = std::as_bytes(std::span<const std::uint8_t>(data, size)).subspan(2);
  std::vector<double> predicted(static_cast<std::size_t>(4 * width));
  for (std::size_t i = 0; i < predicted.size(); ++i)
    predicted[i] = i % 11 == 7 ? NAN : i % 13 == 12 ? 1e300 : 100.0 * std::sin(static_cast<double>(i));
  std::vector<std::byte> raw(predicted.size() * size_bytes(mapping.type));
  try {
    decode_residuals(mapping, width, payload, predicted, raw);
    const std::vector<char> is_void(predicted.size(), 0);
    const isohf::ResidualPayload coded = encode_residuals(mapping, width, raw, is_void, predicted);
    std::vector<std::byte> again(raw.size());
    decode_residuals(mapping, width, coded.bytes, predicted, again);
    if (again != raw) std::abort();
  } catch (const isohf::Error&) {
  }
  try {
    std::vector<isohf::FixedPlace> row(static_cast<std::size_t>(width));
    const isohf::PlaceMesh mesh(width, 3, payload);
    for (int y = 0; y < 3; ++y) mesh.row(y, row);
  } catch (const isohf::Error&) {
  }
  return 0;
}
