#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "formats/binary_grids/described_source.h"
#include "formats/files/text.h"
#include "formats/open_options.h"
#include "formats/readers.h"
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
    if (const auto value = text("nodata_value"); !value.empty())
      set_void(number(value.substr(0, value.find(';')), "NODATA_VALUE"));
    finish(options);
  }
};

}  // namespace

std::unique_ptr<HeightSource> open_saga(const std::string& path, const OpenOptions& options) {
  const auto [data, header] = data_and_header(path, ".sdat", ".sgrd");
  return std::make_unique<SagaSource>(data, header, options);
}

}  // namespace isohf
