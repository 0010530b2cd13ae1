// SPDX-License-Identifier: Apache-2.0
#include "tensor/file_values.hpp"

#include "tensor/leaf_rules.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace symrig::tensor {

Error damaged(const std::string& what) {
  return {ErrorCode::bad_format, what, ""};
}

Error impossible(const std::string& what) {
  return {ErrorCode::bad_value, what, "the file is damaged"};
}

bool all_finite(std::span<const float> values) {
  return std::ranges::all_of(values, [](float v) { return std::isfinite(v); });
}

Result<void> check_values(std::span<const float> values, const std::string& what, float most) {
  if (!all_finite(values)) return impossible(what + " has a value that is not a finite number");
  if (largest_of(values) >= most)
    return impossible(fmt::format("{} has a value that is too large (2^{} or more)", what, std::ilogb(most)));
  return {};
}

}  // namespace symrig::tensor
