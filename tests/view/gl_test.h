#pragma once

#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "gl/offscreen.h"
#include "isohf/error.h"

namespace isohf::test {

/// A test that draws; skipped with the reason where no GL can be had.
class GlTest : public testing::Test {
 protected:
  void SetUp() override {
    try {
      context_ = std::make_unique<view::HeadlessContext>();
    } catch (const Error& error) {
      GTEST_SKIP() << error.what();
    }
  }

 private:
  std::unique_ptr<view::HeadlessContext> context_;
};

}  // namespace isohf::test
