#include <array>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>
#include <utility>

#include "formats/binary_grids/described_source.h"
#include "formats/files/bands.h"
#include "formats/files/text.h"
#include "formats/readers.h"
#include "isohf/base/sample.h"
#include "isohf/error.h"
#include "isohf/raster.h"

namespace isohf {
namespace {

class SagaSource final : public DescribedSource {
 public:
  SagaSource(const std::string& data, const std::string& header, const OpenOptions& options)
      : DescribedSource(data, "SAGA grid", header, options) {
    (void)choose_band(info_, options, 1);
    const HeaderWords words = read_header_words(header, '=');
    set_size(number(words, "cellcount_x"), number(words, "cellcount_y"));
    const auto text = [&](const char* key) { return word_in(words, key); };
    static constexpr std::array<std::pair<std::string_view, SampleType>, 8> kTypes = {
        {{"byte_unsigned", SampleType::kUint8},
         {"byte", SampleType::kInt8},
         {"shortint_unsigned", SampleType::kUint16},
         {"shortint", SampleType::kInt16},
         {"integer_unsigned", SampleType::kUint32},
         {"integer", SampleType::kInt32},
         {"float", SampleType::kFloat32},
         {"double", SampleType::kFloat64}}};
    set_type(kTypes, text("dataformat"), "DATAFORMAT");
    layout_.offset_bytes =
        static_cast<std::uint64_t>(count(number(words, "datafile_offset", 0.0), "DATAFILE_OFFSET", 0.0));
    layout_.big_endian = text("byteorder_big") == "true";
    layout_.from_south = text("toptobottom") != "true";
    set_scale(number(words, "z_factor", 1.0), 0.0, "Z_FACTOR");
    const double cell = number(words, "cellsize");
    place_by_corner(number(words, "position_xmin") - cell / 2.0,
                    number(words, "position_ymin") + (static_cast<double>(info_.height) - 0.5) * cell, cell, cell);
    if (const auto value = text("nodata_value"); !value.empty()) read_voids(value);
    if (!options.void_values.empty()) most_void_ = least_void_;  // the user knows better
    finish(options);
  }

  void read_window(const Window& window, std::span<std::byte> samples) override {
    DescribedSource::read_window(window, samples);
    if (!(least_void_ < most_void_)) return;
    const LoadSample load = load_sample(info_.sample_type);
    const StoreSample store = store_sample(info_.sample_type);
    const std::size_t size = size_bytes(info_.sample_type);
    for (std::size_t at = 0; at < samples.size(); at += size) {
      const double value = load(samples.data() + at);
      if (value > least_void_ && value <= most_void_) store(least_void_, samples.data() + at);
    }
  }

 private:
  /// "-9999", or a range, "-99999;-9999": all of it is void, and delivered as its least value.
  void read_voids(const std::string& text) {
    const std::size_t semicolon = text.find(';');
    double least = number(text.substr(0, semicolon), "NODATA_VALUE");
    if (semicolon == std::string::npos) return set_void(least);
    double most = number(text.substr(semicolon + 1), "NODATA_VALUE");
    if (most < least) std::swap(least, most);
    const auto [lowest, highest] = sample_range(info_.sample_type);
    if (most < lowest || least > highest) return;
    least = nearest_sample(info_.sample_type, is_floating(info_.sample_type) ? least : std::ceil(least));
    if (least > most) return;
    set_void(least);
    least_void_ = least;
    most_void_ = most;
  }

  double least_void_ = std::numeric_limits<double>::quiet_NaN();
  double most_void_ = least_void_;
};

}  // namespace

std::unique_ptr<HeightSource> open_saga(const std::string& path, const OpenOptions& options) {
  const auto [data, header] = data_and_header(path, ".sdat", ".sgrd");
  return std::make_unique<SagaSource>(data, header, options);
}

}  // namespace isohf
