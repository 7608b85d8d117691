// Converts heights that no file holds: a source of one's own, read in windows.
//   custom_height_source waves.isohf
#include <cmath>
#include <cstdio>
#include <cstring>

#include "isohf/isohf.h"

class Waves : public isohf::HeightSource {
 public:
  Waves() {
    info_.path = "waves";  // for messages and the archive's record
    info_.format = "a function";
    info_.width = 800;
    info_.height = 600;
    info_.sample_type = isohf::SampleType::kFloat32;
    info_.vertical_unit = "metre";
    info_.georeference.unit = isohf::HorizontalUnit::kMetre;
    info_.georeference.spacing_x = info_.georeference.spacing_y = 10.0;
  }
  const isohf::SourceInfo& info() const override { return info_; }
  void read_window(const isohf::Window& window, std::span<std::byte> samples) override {
    std::byte* out = samples.data();
    for (std::int64_t row = window.row; row < window.row + window.rows; ++row) {
      for (std::int64_t column = window.column; column < window.column + window.columns; ++column) {
        const auto x = static_cast<float>(column);
        const auto z = static_cast<float>(row);
        const float height = 50.0F * std::sin(0.03F * x) * std::cos(0.05F * z);
        std::memcpy(out, &height, sizeof height);
        out += sizeof height;
      }
    }
  }

 private:
  isohf::SourceInfo info_;
};

int main(int argc, char** argv) {
  if (argc != 2) return std::fprintf(stderr, "usage: custom_height_source ARCHIVE\n"), 2;
  try {
    Waves waves;
    isohf::ConvertOptions options;
    options.overwrite = true;
    options.step = 0.01;
    const isohf::ConvertSummary summary = isohf::convert(waves, argv[1], options);
    const isohf::Statistics& statistics = summary.metadata.statistics;
    std::printf("%.2f to %.2f\n", statistics.min.value(), statistics.max.value());
    return 0;
  } catch (const isohf::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
