#pragma once

#include <cstdint>
#include <cstring>
#include <string>

namespace isohf::test {

/// A small ERDAS Imagine file, 10 x 6 samples of uint8 in two tiles of 8 x 8: the first run-length-coded, the other plain,
/// or both plain in the spill file that imagine_spill() gives ("a.ige").
class ImagineBytes {
 public:
  [[nodiscard]] std::string file(bool spills) {
    bytes_ = std::string("EHFA_HEADER_TAG\0", 16);
    add<std::uint32_t>(20);
    add<std::uint32_t>(1);
    add<std::uint32_t>(0);
    const std::size_t root_at = bytes_.size();
    add<std::uint32_t>(0);
    add<std::uint16_t>(128);
    add<std::uint32_t>(0);
    const std::size_t root = node("root", "root");
    put(root_at, root);
    const std::size_t layer = node("Layer_1", "Eimg_Layer");
    put(root + 12, layer);
    begin_data(layer);
    for (const int side : {10, 6}) add<std::int32_t>(side);
    add<std::uint16_t>(1);
    add<std::uint16_t>(3);  // u8
    for (int side = 0; side < 2; ++side) add<std::int32_t>(8);
    end_data(layer);
    const std::size_t samples =
        spills ? node("ExternalRasterDMS", "ImgExternalRaster") : node("RasterDMS", "Edms_State");
    put(layer + 12, samples);
    begin_data(samples);
    if (spills) {
      text("a.ige");
      for (const std::uint64_t at : {std::uint64_t{26}, std::uint64_t{26 + 20 + 1}}) add(at);
      add<std::int32_t>(1);
      add<std::int32_t>(0);
    } else {
      for (const int number : {2, 64, 2}) add<std::int32_t>(number);
      add<std::uint16_t>(1);
      add<std::int32_t>(2);
      add<std::uint32_t>(0);
      const std::size_t table = bytes_.size();
      bytes_.append(28, '\0');
      entry(table, coded(), true);
      entry(table + 14, std::string(64, '\x21'), false);
    }
    end_data(samples, spills ? 0 : 50);
    const std::size_t place = node("Map_Info", "Eprj_MapInfo");
    put(samples, place);
    begin_data(place);
    text("UTM");
    for (const auto& [x, y] : {std::pair{500000.0, 5200000.0}, {500090.0, 5199950.0}, {10.0, 10.0}}) {
      add<std::uint32_t>(1);
      add<std::uint32_t>(0);
      add(x);
      add(y);
    }
    text("meters");
    end_data(place);
    const std::size_t none = node("Eimg_NonInitializedValue", "Eimg_NonInitializedValue");
    put(place, none);
    begin_data(none);
    for (const int number : {1, 0, 1, 1}) add<std::int32_t>(number);
    add<std::uint16_t>(10);
    add<std::uint16_t>(2);
    add(5.0);
    end_data(none);
    return bytes_;
  }

  [[nodiscard]] static std::string spill() {
    return std::string("ERDAS_IMG_EXTERNAL_RASTER\0", 26) + std::string(20, '\0') + '\3' + std::string(64, '\x10') +
           std::string(64, '\x21');
  }

 private:
  template <typename T>
  void add(T value) {
    bytes_.append(reinterpret_cast<const char*>(&value), sizeof value);
  }
  void put(std::size_t at, std::size_t value) {
    const auto word = static_cast<std::uint32_t>(value);
    std::memcpy(bytes_.data() + at, &word, sizeof word);
  }
  void text(const std::string& words) {
    add(static_cast<std::uint32_t>(words.size() + 1));
    add<std::uint32_t>(0);
    bytes_ += words + '\0';
  }
  std::size_t node(const std::string& name, const std::string& type) {
    const std::size_t at = bytes_.size();
    bytes_.append(128, '\0');
    bytes_.replace(at + 24, name.size(), name);
    bytes_.replace(at + 88, type.size(), type);
    return at;
  }
  void begin_data(std::size_t node) { put(node + 16, bytes_.size()); }
  void end_data(std::size_t node, std::size_t size = 0) {
    std::uint32_t begin = 0;
    std::memcpy(&begin, bytes_.data() + node + 16, sizeof begin);
    put(node + 20, size != 0 ? size : bytes_.size() - begin);
  }
  void entry(std::size_t at, const std::string& tile, bool is_coded) {
    put(at + 2, bytes_.size());
    put(at + 6, tile.size());
    bytes_[at + 10] = '\1';
    bytes_[at + 12] = is_coded ? '\1' : '\0';
    bytes_ += tile;
  }
  /// 40 samples of 16, then 24 of 16 + 3.
  static std::string coded() {
    std::string tile("\x10\0\0\0\2\0\0\0\x0F\0\0\0\4", 13);
    return tile + "\x28\x18" + '\x30';
  }

  std::string bytes_;
};

}  // namespace isohf::test
