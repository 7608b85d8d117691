#include "isohf/restore/residual_codec.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <limits>
#include <random>

#include "isohf/base/sample.h"
#include "isohf/error.h"

namespace isohf {
namespace {

constexpr SampleType kTypes[] = {SampleType::kUint8,   SampleType::kInt8,    SampleType::kUint16,
                                 SampleType::kInt16,   SampleType::kUint32,  SampleType::kInt32,
                                 SampleType::kFloat16, SampleType::kFloat32, SampleType::kFloat64};

struct Samples {
  std::vector<std::byte> raw;
  std::vector<char> voids;
  std::vector<double> predicted;
};

/// Any bits at all, predictions from near to absurd, voids on both sides.
Samples random_samples(SampleType type, std::size_t count, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  Samples samples;
  for (std::size_t i = 0; i < count * size_bytes(type); ++i) samples.raw.push_back(static_cast<std::byte>(random()));
  for (std::size_t i = 0; i < count; ++i) {
    const double value = load_sample(type)(samples.raw.data() + i * size_bytes(type));
    samples.voids.push_back(!std::isfinite(value) || random() % 16 == 0 ? 1 : 0);
    const double offsets[] = {0.0, 1.0, -3.5, 1e30, -1e300};
    const bool none = random() % 16 == 0 || !std::isfinite(value);
    samples.predicted.push_back(none ? std::nan("") : value + offsets[random() % 5]);
  }
  return samples;
}

TEST(ResidualCodec, ReturnsAnyBitsOfAnyType) {
  for (const SampleType type : kTypes) {
    for (const std::size_t rows : {1U, 2U, 7U}) {
      const std::int64_t width = 13;
      const Samples s = random_samples(type, rows * 13, 7 * rows);
      const SampleMapping mapping{type, 0.5, -3.0};
      const auto payload = encode_residuals(mapping, width, s.raw, s.voids, s.predicted).bytes;
      std::vector<std::byte> back(s.raw.size());
      decode_residuals(mapping, width, payload, s.predicted, back);
      EXPECT_EQ(back, s.raw) << to_string(type) << " rows " << rows;
    }
  }
}

TEST(ResidualCodec, RefusesEveryTruncationAndAnExtraByte) {
  const SampleMapping mapping{SampleType::kInt16, 1.0, 0.0};
  const Samples s = random_samples(SampleType::kInt16, 60, 3);
  std::vector<std::byte> payload = encode_residuals(mapping, 10, s.raw, s.voids, s.predicted).bytes;
  std::vector<std::byte> back(s.raw.size());
  for (std::size_t size = 0; size < payload.size(); ++size) {
    EXPECT_THROW(decode_residuals(mapping, 10, std::span(payload).first(size), s.predicted, back), Error) << size;
  }
  payload.push_back(std::byte{0});
  EXPECT_THROW(decode_residuals(mapping, 10, payload, s.predicted, back), Error);
}

TEST(ResidualCodec, RefusesBitsOfTheMaskBehindTheLastSample) {
  const SampleMapping mapping{SampleType::kInt16, 1.0, 0.0};
  const Samples s = random_samples(SampleType::kInt16, 60, 3);
  std::vector<std::byte> payload = encode_residuals(mapping, 10, s.raw, s.voids, s.predicted).bytes;
  ASSERT_EQ(payload[0], std::byte{1});
  std::vector<std::byte> back(s.raw.size());
  const std::size_t last = 33 + 60 / 8;
  EXPECT_NO_THROW(decode_residuals(mapping, 10, payload, s.predicted, back));
  for (unsigned bit = 60 % 8; bit < 8; ++bit) {
    payload[last] ^= std::byte{1} << bit;
    EXPECT_THROW(decode_residuals(mapping, 10, payload, s.predicted, back), Error) << bit;
    payload[last] ^= std::byte{1} << bit;
  }
}

TEST(ResidualCodec, DamagedBytesAreRefusedOrGiveOtherSamples) {
  const SampleMapping mapping{SampleType::kFloat32, 1.0, 0.0};
  const Samples s = random_samples(SampleType::kFloat32, 60, 4);
  const std::vector<std::byte> payload = encode_residuals(mapping, 10, s.raw, s.voids, s.predicted).bytes;
  std::vector<std::byte> back(s.raw.size());
  for (std::size_t i = 0; i < payload.size(); ++i) {
    for (const unsigned change : {1U, 128U, 255U}) {
      std::vector<std::byte> damaged = payload;
      damaged[i] ^= static_cast<std::byte>(change);
      try {
        decode_residuals(mapping, 10, damaged, s.predicted, back);
      } catch (const Error& error) {
        EXPECT_EQ(error.code(), ErrorCode::kCorrupt);
      }
    }
  }
}

/// What archives hold depends on it: 2049 lies between 2048 and 2050, and is predicted as 2050.
TEST(ResidualCodec, PredictsHalvesWithTiesAwayFromZeroAsTheFormatSays) {
  const SampleMapping mapping{SampleType::kFloat16, 1.0, 0.0};
  const std::uint16_t upper = half_from_double(2050.0);
  std::vector<std::byte> raw(2);
  store_sample(SampleType::kFloat16)(2050.0, raw.data());
  const std::vector<char> voids = {0};
  const std::vector<double> predicted = {2049.0};
  const auto payload = encode_residuals(mapping, 1, raw, voids, predicted).bytes;
  EXPECT_EQ(payload.back(), std::byte{0}) << "no residual";
  std::vector<std::byte> back(2);
  decode_residuals(mapping, 1, payload, predicted, back);
  EXPECT_EQ(stored_at<std::uint16_t>(back.data()), upper);
  EXPECT_EQ(half_from_double(2049.0), half_from_double(2048.0)) << "everything else rounds ties to even";
}

}  // namespace
}  // namespace isohf
