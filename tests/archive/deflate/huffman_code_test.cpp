#include "isohf/archive/deflate/huffman_code.h"

#include <gtest/gtest.h>

#include <random>
#include <vector>

namespace isohf {
namespace {

TEST(CodeLengths, AreACompletePrefixCodeWithinTheLimit) {
  std::mt19937 random(3);
  for (const unsigned limit : {7U, 15U}) {
    for (std::size_t symbols = 2; symbols <= (limit == 7 ? 19U : 286U); symbols += 3) {
      std::vector<std::uint32_t> frequencies(symbols);
      std::uint64_t a = 1, b = 1;
      for (std::uint32_t& frequency : frequencies) {  // Fibonacci numbers make the deepest trees
        frequency = symbols % 2 == 0 ? static_cast<std::uint32_t>(std::min<std::uint64_t>(a, 1U << 30U))
                                     : static_cast<std::uint32_t>(random() % 1000 + 1);
        b = std::min<std::uint64_t>(a + b, 1U << 30U);
        std::swap(a, b);
      }
      std::vector<std::uint8_t> lengths(symbols);
      build_code_lengths(frequencies, limit, lengths);
      std::uint64_t filled = 0;
      for (const std::uint8_t length : lengths) {
        ASSERT_GE(length, 1);
        ASSERT_LE(length, limit);
        filled += std::uint64_t{1} << (limit - length);
      }
      EXPECT_EQ(filled, std::uint64_t{1} << limit) << symbols;
      for (std::size_t i = 0; i < symbols; ++i) {
        for (std::size_t j = 0; j < symbols; ++j) {
          if (frequencies[i] > frequencies[j]) {
            ASSERT_LE(lengths[i], lengths[j]);
          }
        }
      }
    }
  }
}

TEST(CodeLengths, GiveALoneSymbolOneBit) {
  const std::vector<std::uint32_t> frequencies = {0, 0, 9};
  std::vector<std::uint8_t> lengths(3, 5);
  build_code_lengths(frequencies, 15, lengths);
  EXPECT_EQ(lengths, (std::vector<std::uint8_t>{0, 0, 1}));
}

}  // namespace
}  // namespace isohf
