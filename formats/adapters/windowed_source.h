#pragma once

#include <cstdint>
#include <memory>
#include <optional>

#include "isohf/raster.h"

namespace isohf {

/// A window of another source, as a source of its own: placed where that window lies.
class WindowedSource : public HeightSource {
 public:
  /// window  inside the source; 1x1 samples at least
  WindowedSource(std::unique_ptr<HeightSource> source, const Window& window);
  ~WindowedSource() override;

  [[nodiscard]] const SourceInfo& info() const override { return info_; }
  void read_window(const Window& window, std::span<std::byte> samples) override;
  [[nodiscard]] bool is_gap(const Window& window) const override {
    return source_.is_gap({window_.column + window.column, window_.row + window.row, window.columns, window.rows});
  }
  [[nodiscard]] std::uint64_t buffer_bytes() const override { return source_.buffer_bytes(); }
  /// The same window of what the other source is made of.
  [[nodiscard]] HeightSource& as_stored() override { return stored_ ? *stored_ : *this; }

 protected:
  [[nodiscard]] SourceInfo& mutable_info() { return info_; }

 private:
  WindowedSource(HeightSource& source, const Window& window);

  std::unique_ptr<HeightSource> own_;  ///< source_, where this is its only user
  HeightSource& source_;
  Window window_;
  SourceInfo info_;
  std::unique_ptr<WindowedSource> stored_;  ///< null: source_ is as stored
};

/// A source without its last column: that of a grid all the way round a body whose last column is its first one again.
class ClosedSource final : public WindowedSource {
 public:
  /// At least two columns.
  explicit ClosedSource(std::unique_ptr<HeightSource> source);

 private:
  ClosedSource(const Window& window, std::unique_ptr<HeightSource>&& source);
  ClosedSource(const Window& window, std::unique_ptr<HeightSource>&& source, std::optional<std::int64_t> other_row);
};

}  // namespace isohf
