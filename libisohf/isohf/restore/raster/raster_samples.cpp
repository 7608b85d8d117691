#include "isohf/restore/raster/raster_samples.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "isohf/base/sample.h"

namespace isohf {
namespace {

Job staged(const Job& job, const char* stage) {
  Job made = job;
  if (job.progress) {
    made.progress = [tell = job.progress, stage](Progress at) {
      at.stage = stage;
      tell(at);
    };
  }
  return made;
}

/// The raw value that stands for nodata if there is some: NaN in floats, which other programs expect to be declared.
std::optional<double> nodata_of(SampleType type, bool has_nodata) {
  if (!has_nodata) return std::nullopt;
  return usual_nodata(type).value_or(std::numeric_limits<double>::quiet_NaN());
}

SampleType source_type(const Metadata& metadata) {
  return sample_type_from_string(metadata.source.sample_type);
}

/// Scale and offset that hold all elevations, as "`raw_scale` 0.0162 `raw_offset` -530.8416, "; empty for floats.
/// Elevation 0 keeps its number, as engines have the sea at one, if that is possible. The numbers at both ends are left
/// for nodata.
std::string mapping_for(const SampleMapping& mapping, double least, double greatest) {
  if (is_floating(mapping.type)) return {};
  const auto [low, high] = sample_range(mapping.type);
  const double zero = -mapping.z_offset / mapping.z_scale;
  const double below = zero - low - 1.0;  // numbers on either side of elevation 0
  const double above = high - 1.0 - zero;
  const bool keeps_zero = (least >= 0.0 || below > 0.0) && (greatest <= 0.0 || above > 0.0);
  const double needed = keeps_zero
                            ? std::max(least < 0.0 ? -least / below : 0.0, greatest > 0.0 ? greatest / above : 0.0)
                            : (greatest - least) / (high - low - 2.0);
  if (!(needed > 0.0)) return {};
  const double unit = std::pow(10.0, std::floor(std::log10(needed)) - 2.0);
  const double scale = std::ceil(needed * 1.001 / unit) * unit;  // the surface may leave the range of its vertices
  const double offset = keeps_zero ? 0.0 - zero * scale : least - (low + 1.0) * scale;
  return fmt::format("`raw_scale` {:.3g}{}, ", scale, offset == 0.0 ? "" : fmt::format(" `raw_offset` {:.9g}", offset));
}

std::string remedy_for(const SampleMapping& mapping, const Statistics& elevations) {
  const std::string ways = "`clamp_range`, `method` barycentric or another `code_type`";
  if (!elevations.min || !elevations.max) return "use " + ways;
  return fmt::format("use {}{} (elevations are {:.9g} to {:.9g})",
                     mapping_for(mapping, *elevations.min, *elevations.max), ways, *elevations.min, *elevations.max);
}

class SurfaceSamples final : public RasterSamples {
 public:
  SurfaceSamples(const ArchiveReader& archive, const SampleGrid& grid, const RasterRequest& request, const Job& job)
      : archive_(archive),
        grid_(grid),
        request_(request),
        method_(request.method.value_or(usual_method(archive.metadata(), grid))),
        job_(job) {
    bool has_nodata = may_have_nodata(archive.metadata(), grid) || request.needs_nodata;
    mapping_ = choose_mapping(has_nodata);
    nodata_ = nodata_of(mapping_.type, has_nodata);
  }

  void read_all(const Take& take) override {
    const Metadata& metadata = archive_.metadata();
    // All samples of the source are of its type: what lies beyond its ends is overshoot.
    const bool is_source_type = request_.as_source && mapping_.type == source_type(metadata);
    const auto clamp = request_.clamps  ? SampleStore::Clamp::kAll
                       : is_source_type ? SampleStore::Clamp::kAtFreeEnds
                                        : SampleStore::Clamp::kNone;
    RowStore store({mapping_, nodata_, clamp}, {request_.path, grid_.width, remedy_for(mapping_, metadata.statistics)});
    const Job job = staged(job_, "export");
    RowReader(archive_, grid_, method_, job)
        .read_all(
            [&](std::int64_t row, std::span<const double> elevations) { take(row, store.raw_rows(row, elevations)); },
            job);
    counts_ = store.counts();
    if (counts_.clamped == 0 || request_.clamps) return;
    warnings_.emplace_back(fmt::format("{}: {} samples of the surface overshoot the {} of its source and were clamped",
                                       request_.path, counts_.clamped, to_string(mapping_.type)));
  }

  [[nodiscard]] SampleStore::Result counts() const override { return counts_; }

 private:
  SampleMapping choose_mapping(bool& has_nodata) {
    const Metadata& metadata = archive_.metadata();
    const SourceRecord& source = metadata.source;
    const SampleType type = request_.type;
    if (request_.scale || request_.offset) return {type, request_.scale.value_or(1.0), request_.offset.value_or(0.0)};
    const SampleMapping found =
        request_.as_source ? SampleMapping{type, source.z_scale, source.z_offset} : SampleMapping{type, 1.0, 0.0};
    const std::string unit = metadata.vertical_unit == "unknown" ? "of their unit" : metadata.vertical_unit;
    const double largest =
        std::max(std::abs(metadata.statistics.min.value_or(0.0)), std::abs(metadata.statistics.max.value_or(0.0)));
    if (type == SampleType::kFloat16 && largest > 0.0 && !(request_.as_source && source_type(metadata) == type)) {
      warnings_.push_back(loss(fmt::format("{}: half floats have 11 bits: elevations are rounded by up to {:.3g} {}",
                                           request_.path, std::exp2(std::ilogb(largest) - 11), unit)));
    }
    const bool takes_decimals = !is_floating(type) && found.z_scale == 1.0 && is_floating(source_type(metadata));
    const bool is_unsigned = type == SampleType::kUint8 || type == SampleType::kUint16;
    if (request_.as_source ? takes_decimals && request_.states_scale : is_unsigned)
      return spread_over_range(has_nodata);
    if (takes_decimals) {
      warnings_.push_back(
          loss(fmt::format("{}: holds whole numbers: elevations are rounded by up to 0.5 {}", request_.path, unit)));
    }
    return found;
  }

  SampleMapping spread_over_range(bool& has_nodata) const {
    double low = std::numeric_limits<double>::infinity();
    double high = -low;
    has_nodata = false;
    const Job job = staged(job_, "range");
    RowReader(archive_, grid_, method_, job)
        .read_all(
            [&](std::int64_t, std::span<const double> elevations) {
              for (const double z : elevations) {
                has_nodata = has_nodata || std::isnan(z);
                low = z < low ? z : low;
                high = z > high ? z : high;
              }
            },
            job);
    // Filters leave some rounding of level ground, which spread over all numbers would be noise.
    if (high - low <= 1e-7 * std::max(std::abs(low), std::abs(high))) high = low;
    return low <= high ? spread(request_.type, {low, high}, has_nodata) : SampleMapping{request_.type, 1.0, 0.0};
  }

  const ArchiveReader& archive_;
  SampleGrid grid_;
  RasterRequest request_;
  RestoreMethod method_;
  Job job_;
  SampleStore::Result counts_;
};

class SourceSamples final : public RasterSamples {
 public:
  SourceSamples(const ArchiveReader& archive, const RasterRequest& request, const Job& job)
      : archive_(archive), path_(request.path), job_(staged(job, "export")) {
    const Metadata& metadata = archive.metadata();
    record_ = lossless_record(metadata).value();
    mapping_ = {request.type, record_.mapping.z_scale, record_.mapping.z_offset};
    if (!record_.void_values.empty()) nodata_ = record_.void_values.front();
    // Text holds any number, and has no place for a scale.
    as_elevations_ = request.is_text && (mapping_.z_scale != 1.0 || mapping_.z_offset != 0.0);
    if (as_elevations_) mapping_ = {SampleType::kFloat64, 1.0, 0.0};
    // What came from such a format has no voids but the user's.
    const bool to_nan = request.voids_are_nan && is_floating(mapping_.type) && metadata.source.format != "OpenEXR";
    as_kept_ = mapping_.type == record_.mapping.type && !to_nan && !as_elevations_;
    // A void value that the type does not hold is missed only if a sample is void.
    const bool lacks_nodata =
        nodata_ && !as_kept_ && !SampleStore(mapping_, std::nullopt, SampleStore::Clamp::kNone).holds(*nodata_);
    if (to_nan || as_elevations_ || lacks_nodata) nodata_.reset();
    if (!nodata_ && is_floating(mapping_.type)) {
      const bool has_nodata = may_have_nodata(metadata, source_grid(metadata.source)) || request.needs_nodata;
      nodata_ = nodata_of(mapping_.type, has_nodata);
    }
    voids_as_ = to_nan ? std::nan("") : nodata_;
  }

  void read_all(const Take& take) override {
    SourceRowReader reader(archive_, job_);
    std::map<std::optional<double>, std::int64_t> undeclared;
    for (std::int64_t row = 0; !reader.at_end();) {
      const std::vector<std::byte> raw = reader.read_next();
      if (as_kept_) {
        count_undeclared(raw, undeclared);
        take(row, raw);
      } else {
        take(row, converted(row, raw));
      }
      row += static_cast<std::int64_t>(raw.size() / size_bytes(record_.mapping.type)) / record_.width;
    }
    for (const auto& [value, count] : undeclared) {
      const std::string which =
          value ? fmt::format("hold {:.9g}", *value)
                : fmt::format("are outside {:.9g} to {:.9g}", record_.valid.first, record_.valid.second);
      warnings_.push_back(
          loss(fmt::format("{}: {} samples {}, which meant nodata and is not declared; read it with {}, or write one "
                           "nodata value by `surface`",
                           path_, count, which, value ? "`void_values`" : "`valid_range`")));
    }
  }

 private:
  [[nodiscard]] std::vector<std::byte> converted(std::int64_t row, const std::vector<std::byte>& raw) const {
    const std::size_t from_bytes = size_bytes(record_.mapping.type);
    std::vector<std::byte> out(raw.size() / from_bytes * size_bytes(mapping_.type));
    if (as_elevations_) {
      elevations_of(record_, raw, out);
      return out;
    }
    if (const auto refused = convert_exactly(record_, raw, voids_as_, mapping_.type, out)) {
      const double value = load_sample(record_.mapping.type)(raw.data() + *refused * from_bytes);
      const auto sample = static_cast<std::int64_t>(*refused);
      refuse_sample({path_, record_.width, "use another format or `code_type`, or `surface`"}, mapping_.type,
                    row * record_.width + sample,
                    fmt::format("{:.9g}{}", value, record_.is_void(value) ? " (nodata)" : ""));
    }
    return out;
  }

  /// Voids that the raster cannot declare, as kept: how often each value is there, nullopt for those by a range.
  void count_undeclared(const std::vector<std::byte>& raw,
                        std::map<std::optional<double>, std::int64_t>& counts) const {
    const bool has_range = std::isfinite(record_.valid.first) || std::isfinite(record_.valid.second);
    if (record_.void_values.size() <= 1 && !has_range) return;
    const LoadSample load = load_sample(record_.mapping.type);
    for (std::size_t at = 0; at < raw.size(); at += size_bytes(record_.mapping.type)) {
      const double value = load(raw.data() + at);
      if (value == nodata_ || !std::isfinite(value) || !record_.is_void(value)) continue;
      const bool is_listed = std::ranges::find(record_.void_values, value) != record_.void_values.end();
      ++counts[is_listed ? std::optional(value) : std::nullopt];
    }
  }

  const ArchiveReader& archive_;
  std::string path_;
  Job job_;
  LosslessRecord record_;
  std::optional<double> voids_as_;
  bool as_elevations_ = false;
  bool as_kept_ = false;
};

}  // namespace

std::unique_ptr<RasterSamples> surface_samples(const ArchiveReader& archive, const SampleGrid& grid,
                                               const RasterRequest& request, const Job& job) {
  return std::make_unique<SurfaceSamples>(archive, grid, request, job);
}

std::unique_ptr<RasterSamples> source_samples(const ArchiveReader& archive, const RasterRequest& request,
                                              const Job& job) {
  return std::make_unique<SourceSamples>(archive, request, job);
}

}  // namespace isohf
