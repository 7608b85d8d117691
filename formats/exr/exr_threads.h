#pragma once

namespace isohf {

/// Gives the OpenEXR library its own threads, once: they code the chunks of one request side by side. Four of them
/// already outrun what stands before and behind them.
void start_exr_threads();

}  // namespace isohf
