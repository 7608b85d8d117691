#include <cstdio>

#include "isohf/archive.h"
#include "isohf/error.h"
#include "isohf/lattice.h"

/// Exit code 0 when pure geometry links, and the reader with all that it is built on.
int main() {
  const auto shape = isohf::TileShape::make(212, 243, 4);
  try {
    const isohf::ArchiveReader archive("missing.isohf");
  } catch (const isohf::Error& e) {
    std::printf("%d columns; %s\n", static_cast<int>(shape.columns()), e.what());
    return e.code() == isohf::ErrorCode::kIo ? 0 : 1;
  }
  return 1;
}
