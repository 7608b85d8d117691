#pragma once

#include "isohf/verify/verify.h"

namespace isohf {

/// Ids of the catalogue in findings.cpp; numbers are for ever.
namespace finding {
inline constexpr int kNotReadable = 1;
inline constexpr int kReadByDirectory = 2;
inline constexpr int kTileUndecodable = 3;
inline constexpr int kTileCodeRange = 4;
inline constexpr int kTileVoidFlag = 5;
inline constexpr int kTileEmpty = 6;
inline constexpr int kSharedVertex = 7;
inline constexpr int kPadding = 8;
inline constexpr int kNormal = 9;
inline constexpr int kStatistics = 10;
inline constexpr int kContentHash = 11;
inline constexpr int kTileCount = 12;
inline constexpr int kElevationRange = 13;
inline constexpr int kMemberUnreadable = 14;
inline constexpr int kStructure = 15;
inline constexpr int kSourceLost = 16;
inline constexpr int kSourceInvented = 17;
inline constexpr int kLossless = 18;
inline constexpr int kTileNotDeflate = 20;
inline constexpr int kTexture = 21;
inline constexpr int kVertex = 22;
inline constexpr int kShadowSeeds = 23;
inline constexpr int kMetadata = 24;
inline constexpr int kAccuracy = 25;
}  // namespace finding

/// Severity of a catalogue id.
[[nodiscard]] Severity severity_of(int id);

}  // namespace isohf
