// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "projector/drm/flipper.hpp"
#include "projector/drm/saved_screen.hpp"
#include "symrig/projector/placement.hpp"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace symrig::projector::drm {

struct ScreenOptions {
  std::size_t buffers = 3;  // 2 or 3
  bool legacy = false;      // never uses atomic commits
  Nanoseconds patience{3'000'000'000};
};

/// A screen that symrig owns. It is black at first. The destructor restores the earlier state.
class Screen {
 public:
  /// fails: device_refused (a desktop uses the card; the mode or an identity value is not possible),
  /// device_lost, unknown_name and bad_argument (connector or mode), limit (memory).
  static Result<std::unique_ptr<Screen>> take(Cards& cards, const std::string& connector,
                                              const std::string& mode, const ScreenOptions& options);
  ~Screen();
  Screen(const Screen&) = delete;
  Screen& operator=(const Screen&) = delete;

  Grid grid() const { return route_.grid(); }
  Nanoseconds period() const { return route_.period(); }
  const Route& route() const { return route_; }
  bool atomic() const { return atomic_; }
  bool counted() const { return flipper_->counted(); }
  SteadyTime now() const { return kms_->now(); }
  const std::string& driver() const { return driver_; }
  const std::vector<std::string>& warnings() const { return warnings_; }

  /// Only buffers that the screen does not show may be drawn into.
  std::size_t buffers() const { return buffers_.size(); }
  ScreenMemory memory(std::size_t buffer) const;
  /// Requests a buffer for the next refresh.
  /// fails: as Flipper::submit().
  Result<void> submit(std::size_t buffer) { return flipper_->submit(buffers_[buffer].fb); }
  /// Waits until the screen shows it and its refresh has begun.
  /// fails: as Flipper::await().
  Result<Shown> await();
  /// Checks that the projector was connected without a break since the last call.
  /// fails: device_lost.
  Result<void> check();

 private:
  Screen(std::unique_ptr<Kms> kms, Route route);
  Result<void> make_buffers(std::size_t count);
  Result<void> light_up(const ScreenOptions& options);
  bool link_is_bad();

  std::unique_ptr<Kms> kms_;
  Route route_;
  std::string driver_;
  bool atomic_ = false;
  std::vector<Buffer> buffers_;
  std::vector<std::uint32_t> blobs_;
  std::optional<SavedScreen> saved_;
  std::optional<Flipper> flipper_;
  std::vector<std::string> warnings_;
};

}  // namespace symrig::projector::drm
