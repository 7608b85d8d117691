#pragma once

#include <gtest/gtest.h>

#include "isohf/error.h"

namespace isohf::test {

/// The Error that `action` throws; fails the test where it throws none.
template <typename Action>
Error error_of(const Action& action) {
  try {
    action();
  } catch (const Error& error) {
    return error;
  }
  ADD_FAILURE() << "no error";
  return {ErrorCode::kCancelled, ""};
}

}  // namespace isohf::test
