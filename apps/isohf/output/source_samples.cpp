#include "output/source_samples.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>

#include "isohf/base/sample.h"
#include "isohf/error.h"
#include "isohf/restore/sample_grids.h"
#include "isohf/surface.h"
#include "output/restored_raster.h"
#include "output/standard_output.h"

namespace isohf::cli {

WrittenSamples write_source_samples(const Common& common, const ArchiveReader& archive,
                                    const SourceSamplesTarget& target, const Job& job) {
  const Metadata& metadata = archive.metadata();
  const RasterKind kind = raster_kind(target.output);
  SourceRowReader reader(archive, job);
  const LosslessRecord& record = reader.record();
  const SampleMapping kept = record.mapping;
  SampleMapping written = kept;
  // Text holds any number, and has no place for a scale.
  const bool as_elevations = kind == RasterKind::kAsc && (kept.z_scale != 1.0 || kept.z_offset != 0.0);
  written.type = target.type.value_or(restored_type(target.output, kept.type));
  if (as_elevations) written = {SampleType::kFloat64, 1.0, 0.0};
  auto void_value = record.void_values.empty() ? std::nullopt : std::optional(record.void_values.front());
  // OpenEXR has no void value; what came from there has none but the user's.
  const bool voids_to_nan =
      kind == RasterKind::kExr && is_floating(written.type) && metadata.source.format != "OpenEXR";
  const bool as_kept = written.type == kept.type && !voids_to_nan && !as_elevations;
  // A void value that the type does not hold is missed only where a sample is void.
  const bool lacks_void =
      void_value && !as_kept && !SampleStore(written, std::nullopt, SampleStore::Clamp::kNone).holds(*void_value);
  if (voids_to_nan || as_elevations || lacks_void) void_value.reset();
  if (!void_value && is_floating(written.type)) {
    void_value = void_value_of(written.type, needs_void(metadata, source_grid(metadata.source), target.output));
  }
  RasterSpec spec = source_raster_spec(metadata, written, void_value);
  spec.overwrite = target.overwrite;
  spec.scratch = target.scratch;
  const std::unique_ptr<RasterSink> sink = create_raster(target.output, spec);
  warn_of_losses(common, target.output, sink->spec());
  std::int64_t row = 0;
  // Voids that the output has no word for, and how often they stand there: a value each, nullopt by a range.
  std::map<std::optional<double>, std::int64_t> untold;
  const std::optional<double> voids_as = voids_to_nan ? std::nan("") : void_value;
  while (!reader.at_end()) {
    const std::vector<std::byte> raw = reader.read_next();
    const std::size_t count = raw.size() / size_bytes(kept.type);
    if (as_kept && (record.void_values.size() > 1 || metadata.source.raw_range)) {
      const LoadSample load = load_sample(kept.type);
      for (std::size_t i = 0; i < count; ++i) {
        const double value = load(raw.data() + i * size_bytes(kept.type));
        if (value == void_value || !std::isfinite(value) || !record.is_void(value)) continue;
        const bool is_listed = std::ranges::find(record.void_values, value) != record.void_values.end();
        ++untold[is_listed ? std::optional(value) : std::nullopt];
      }
    }
    if (as_kept) {
      sink->write_rows(raw);
    } else {
      std::vector<std::byte> out(count * size_bytes(written.type));
      if (as_elevations) {
        elevations_of(record, raw, out);
      } else if (const auto refused = convert_exactly(record, raw, voids_as, written.type, out)) {
        const auto sample = static_cast<std::int64_t>(*refused);
        const double value = load_sample(kept.type)(raw.data() + *refused * size_bytes(kept.type));
        const bool is_void = record.is_void(value);
        std::string remedy = is_void ? "write .tif, or give --method hex for a void value of its own" : "write .tif";
        if (target.type) remedy = "without --type it is " + to_string(kept.type) + ", as in the source";
        refuse_sample(target.output, written.type, sample % record.width, row + sample / record.width,
                      fmt::format("{:.9g}{}", value, is_void ? " (void)" : ""), remedy);
      }
      sink->write_rows(out);
    }
    row += static_cast<std::int64_t>(count) / record.width;
  }
  for (const auto& [value, count] : untold) {
    const std::string which =
        value ? fmt::format("hold {:.9g}", *value)
              : fmt::format("lie outside {:.9g} to {:.9g}", record.valid.first, record.valid.second);
    print_warning(common,
                  loss(fmt::format("{}: {} samples {}, which meant no elevation: a reader must be told, as with "
                                   "{}; --method hex writes one void value",
                                   target.output, count, which, value ? "--nodata" : "--valid-range")));
  }
  sink->finish();
  return {written, sink->files()};
}

}  // namespace isohf::cli
