// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/image/grid.hpp"
#include "symrig/image/image.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace symrig::rig {

/// Sets mean and variance to 0 where valid is 0. Then the first value that no photograph may have: a valid
/// that is not 0 or 1, NaN, infinity, a negative variance. none: all are good.
std::optional<std::string> settle(Radiance& photograph);

/// What a camera that looks through a mirror exchanges.
struct Mirrored {
  bool rows = false, columns = false;
};
void set_right(Radiance& photograph, Mirrored mirrored);

/// What an exec: rig states about itself.
struct ExecShape {
  Grid cells, camera;
  ViewLayout views;
  int channels = 0;
  std::string name;
  std::optional<Nanoseconds> patience;
  Mirrored mirrored;  ///< of its photographs against its patterns

  /// One photograph: mean and variance as float, valid as byte.
  std::int64_t photograph_bytes() const { return camera.size() * channels * 9; }
};

inline constexpr std::string_view kGreeting = "symrig-exec 1\n";
inline constexpr std::string_view kAnswerBegin = "version=";
inline constexpr std::size_t kLongestAnswer = 1024;
inline constexpr std::string_view kHeaderBegin = "photograph ";
inline constexpr std::size_t kLongestHeader = 64;

/// The answer to the greeting: "version=1 cells=64x64 channels=3 name=studio". An error's `what` completes
/// "exec:COMMAND ".
/// fails: protocol, limit.
Result<ExecShape> parse_exec_answer(std::string_view line);

/// The line before each photograph: "photograph 3 2304".
struct PhotographHeader {
  std::int64_t number = 0, bytes = 0;
};
std::optional<PhotographHeader> parse_photograph_header(std::string_view line);

}  // namespace symrig::rig
