#include "isohf/archive/codec/predict/residual_fold.h"

#include "isohf/archive/codec/predict/hex_predictor.h"
#include "isohf/archive/codec/residuals/residual_symbols.h"
#include "isohf/base/vectorised.h"

namespace isohf {
namespace {

ISOHF_VECTORISED(void, fold_codes,
                 (const std::int32_t* own, const std::int32_t* halves, int count, std::uint16_t* __restrict out),
                 (own, halves, count, out)) {
  for (int i = 0; i < count; ++i) {
    const auto difference = static_cast<std::int16_t>(oriented_difference(own[i], halves[i]));
    out[i] = static_cast<std::uint16_t>(zigzag(difference));
  }
}

ISOHF_VECTORISED(void, fold_floats,
                 (const std::int64_t* own, const std::int64_t* halves, int count, std::uint32_t* __restrict out),
                 (own, halves, count, out)) {
  for (int i = 0; i < count; ++i) out[i] = zigzag(static_cast<std::int32_t>(oriented_difference(own[i], halves[i])));
}

}  // namespace

void fold_row(const std::int32_t* own, const std::int32_t* halves, int count, std::uint16_t* out) {
  fold_codes(own, halves, count, out);
}
void fold_row(const std::int64_t* own, const std::int64_t* halves, int count, std::uint32_t* out) {
  fold_floats(own, halves, count, out);
}

}  // namespace isohf
