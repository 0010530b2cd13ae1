// SPDX-License-Identifier: Apache-2.0
#include "symrig/base/byte_size.hpp"

#include <charconv>
#include <limits>
#include <string>

namespace symrig {

Result<std::int64_t> parse_byte_size(std::string_view text) {
  constexpr std::string_view kUnits = "KMGT";
  const auto refused = [&] {
    return Error{ErrorCode::bad_argument, "'" + std::string(text) + "' is no size of memory",
                 "give bytes, or a number with K, M, G or T, such as 4G"};
  };
  std::int64_t number = 0;
  const auto [end, failed] = std::from_chars(text.data(), text.data() + text.size(), number);
  const std::string_view rest = text.substr(static_cast<std::size_t>(end - text.data()));
  if (failed != std::errc() || number < 1 || rest.size() > 1) return refused();
  if (rest.empty()) return number;
  const std::size_t unit = kUnits.find(rest[0]);
  if (unit == std::string_view::npos) return refused();
  const int shift = 10 * (static_cast<int>(unit) + 1);
  if (number > std::numeric_limits<std::int64_t>::max() >> shift) return refused();
  return number << shift;
}

}  // namespace symrig
