// SPDX-License-Identifier: Apache-2.0
#include "projector/dlp/signal.hpp"

#include <cmath>
#include <thread>

#include <fmt/format.h>

namespace symrig::projector::dlp {
namespace {

/// A source and a mode that differ by more are two modes. 59.94 and 60 Hz differ by 0.1 %.
constexpr double kSameRefresh = 0.005;

}  // namespace

/// A source of 120 Hz shows each picture of a 60 Hz program twice, and its planes take half the time.
Result<void> check_signal(const std::string& controller, const Signal& signal, const PictureSource& source,
                          Grid mirrors) {
  const double wanted = 1 / seconds(source.refresh);
  if (!signal.locked)
    return Error{ErrorCode::device_refused, fmt::format("{} receives no stable video signal", controller),
                 "connect the screen's cable to it"};
  if (source.grid != mirrors || signal.rows != mirrors.rows || signal.cols != mirrors.cols)
    return Error{
        ErrorCode::device_refused,
        fmt::format("{} receives {}x{} of a screen of {}x{}, and shows bit planes only of {}x{}", controller,
                    signal.cols, signal.rows, source.grid.cols, source.grid.rows, mirrors.cols, mirrors.rows),
        fmt::format("set projector.mode = \"{}x{}@60\"", mirrors.cols, mirrors.rows)};
  if (signal.refresh_hz > 0 && std::abs(signal.refresh_hz / wanted - 1) <= kSameRefresh) return {};
  return Error{ErrorCode::device_refused,
               fmt::format("{} receives {:.4g} pictures a second, but the screen's mode has {:.4g}",
                           controller, signal.refresh_hz, wanted),
               "connect the cable of the screen that the rig file names, or set its mode"};
}

Result<void> await_signal(const std::function<Result<void>()>& check, Nanoseconds patience) {
  constexpr Nanoseconds kPause{100'000'000};
  for (Nanoseconds waited{0};; waited += kPause) {
    auto checked = check();
    if (checked || checked.error().code != ErrorCode::device_refused || waited >= patience) return checked;
    std::this_thread::sleep_for(kPause);
  }
}

}  // namespace symrig::projector::dlp
