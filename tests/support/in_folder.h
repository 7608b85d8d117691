#pragma once

#include <gtest/gtest.h>

#include <string>

#include "support/temporary_folder.h"

namespace isohf::test {

/// A test with a folder of its own.
class InFolder : public ::testing::Test {
 protected:
  const TemporaryFolder folder;
};

}  // namespace isohf::test
