#pragma once

#include <algorithm>
#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <utility>
#include <vector>

namespace isohf::test {

template <typename T>
std::string stored_bytes(const std::vector<T>& values, bool is_big_endian = false) {
  std::string bytes;
  for (const T value : values) {
    std::string each(sizeof(T), '\0');
    std::memcpy(each.data(), &value, sizeof(T));
    if (is_big_endian) std::reverse(each.begin(), each.end());
    bytes += each;
  }
  return bytes;
}
template <typename T>
std::string big_endian(const std::vector<T>& values) {
  return stored_bytes(values, true);
}

/// A netCDF file in the first of its classic formats.
class NetcdfBytes {
 public:
  using Texts = std::vector<std::pair<std::string, std::string>>;
  using Numbers = std::vector<std::pair<std::string, std::vector<double>>>;

  NetcdfBytes& dimension(const std::string& name, std::uint32_t size) {
    dimensions_ += text(name) + word(size);
    ++dimension_count_;
    return *this;
  }
  /// How many records there are of a variable along a dimension of size 0; one variable alone may be.
  NetcdfBytes& records(std::uint32_t count) {
    records_ = count;
    return *this;
  }
  /// type  5: float, 6: double, 3: short; samples are big-endian
  NetcdfBytes& variable(const std::string& name, const std::vector<std::uint32_t>& dimensions, std::uint32_t type,
                        std::string samples, const Texts& attributes, const Numbers& numbers = {}) {
    std::string head = text(name) + word(static_cast<std::uint32_t>(dimensions.size()));
    for (const std::uint32_t dimension : dimensions) head += word(dimension);
    const std::size_t count = attributes.size() + numbers.size();
    head += word(count == 0 ? 0 : 12) + word(static_cast<std::uint32_t>(count));
    for (const auto& [key, value] : attributes) head += text(key) + word(2) + text(value);
    for (const auto& [key, list] : numbers) {
      head += text(key) + word(6) + word(static_cast<std::uint32_t>(list.size()));
      for (const double number : list) {
        const auto bits = std::bit_cast<std::uint64_t>(number);
        head += word(static_cast<std::uint32_t>(bits >> 32U)) + word(static_cast<std::uint32_t>(bits));
      }
    }
    samples.resize((samples.size() + 3) / 4 * 4);
    variables_.push_back({head + word(type) + word(static_cast<std::uint32_t>(samples.size())), samples});
    return *this;
  }
  [[nodiscard]] std::string bytes() const {
    std::string head = std::string("CDF\1") + word(records_) + word(10) + word(dimension_count_) + dimensions_ +
                       word(0) + word(0) + word(11) + word(static_cast<std::uint32_t>(variables_.size()));
    std::size_t begin = head.size();
    for (const auto& [variable, samples] : variables_) begin += variable.size() + 4;
    std::string all;
    for (const auto& [variable, samples] : variables_) {
      head += variable + word(static_cast<std::uint32_t>(begin + all.size()));
      all += samples;
    }
    return head + all;
  }

 private:
  static std::string word(std::uint32_t value) {
    std::string bytes;
    for (unsigned shift = 32; shift > 0; shift -= 8) bytes += static_cast<char>(value >> (shift - 8) & 0xFFU);
    return bytes;
  }
  static std::string text(const std::string& value) {
    std::string bytes = word(static_cast<std::uint32_t>(value.size())) + value;
    bytes.resize((bytes.size() + 3) / 4 * 4);
    return bytes;
  }

  std::string dimensions_;
  std::uint32_t dimension_count_ = 0;
  std::uint32_t records_ = 0;
  std::vector<std::pair<std::string, std::string>> variables_;
};

}  // namespace isohf::test
