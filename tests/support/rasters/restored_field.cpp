#include "support/rasters/restored_field.h"

#include <atomic>
#include <stdexcept>

#include "isohf/archive.h"
#include "isohf/convert.h"
#include "support/rasters/memory_source.h"
#include "support/temporary_folder.h"

namespace isohf::test {

double psnr_of_restoring(Filter filter, const TrigonometricField& field, int margin, RestoreMethod method) {
  const int n = field.n();
  const std::vector<float> samples = field.samples();
  const auto sample_at = [&](std::int64_t c, std::int64_t r) { return samples[static_cast<std::size_t>(r * n + c)]; };
  MemorySource<float> source(SampleType::kFloat32, n, n,
                             [&](std::int64_t c, std::int64_t r) { return static_cast<double>(sample_at(c, r)); });
  ConvertOptions options;
  options.filter = filter;
  options.code_type = CodeType::kF32;
  options.plan.shape = {30, 33};
  options.plan.levels = 1;
  options.plan.spacing = 1.0;
  options.plan.outside = Outside::kCover;
  const TemporaryFolder folder;
  (void)convert(source, folder / "field.isohf", options);

  const ArchiveReader archive(folder / "field.isohf");
  RowReader surface(archive, source_grid(archive.metadata().source), method);
  std::vector<double> restored(samples.size());
  surface.read(0, n, restored);
  double squares = 0.0;
  std::int64_t count = 0;
  for (int r = margin; r < n - margin; ++r) {
    for (int c = margin; c < n - margin; ++c) {
      const double error = restored[static_cast<std::size_t>(r * n + c)] - static_cast<double>(sample_at(c, r));
      squares += error * error;
      ++count;
    }
  }
  return psnr(samples, squares, count);
}

}  // namespace isohf::test
