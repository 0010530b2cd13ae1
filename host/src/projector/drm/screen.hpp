// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/projector/internal/drm.hpp"
#include "symrig/projector/projector.hpp"

#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace symrig::projector::drm {

/// The state of a screen before symrig took it. It can be restored.
class SavedScreen {
 public:
  /// Saves mode, picture and connectors of a route's CRTC.
  static SavedScreen take(Kms& kms, const Route& route);
  /// Saves a property before it is set. Copies a blob's bytes, because its owner may have ended before the
  /// restore.
  void remember(Kms& kms, const IdentityValue& identity);
  void remember(Gamma gamma) { gamma_ = std::move(gamma); }
  /// Restores as much as the kernel allows. If the owner of the picture has ended, the screen goes off. The
  /// kernel's console then takes it when the card is closed.
  void restore(Kms& kms) const;

 private:
  struct SavedProperty {
    Setting setting;
    std::vector<std::byte> blob;  // empty: the value is a number
  };

  Crtc crtc_;
  std::vector<std::uint32_t> connectors_;
  std::optional<Gamma> gamma_;
  std::vector<SavedProperty> properties_;
};

/// Shows framebuffers one after the other, each at a refresh, and reports that refresh.
class Flipper {
 public:
  /// patience: longest wait for a refresh.
  Flipper(Kms& kms, const Route& route, bool atomic, Nanoseconds patience);

  /// Finds out if the card counts refreshes, with a few flips between framebuffers of equal content. Until
  /// this is called, counted() is false. warning: why the card does not count.
  /// fails: as submit() and await().
  Result<void> learn(std::span<const std::uint32_t> fbs, std::string& warning);

  /// Requests fb for the next refresh. No other flip may be pending.
  /// fails: device_lost, limit, device_refused, timeout (the previous flip never ended).
  Result<void> submit(std::uint32_t fb);
  /// Waits until the screen shows it.
  /// fails: timeout (no refresh), device_lost (also if the refresh count went back: another program has set
  /// the mode).
  Result<Shown> await();

  bool counted() const { return counted_; }

 private:
  Errno send(std::uint32_t fb);
  KernelAnswer<FlipEvent> event_of_current();
  Result<std::uint64_t> extend(std::uint32_t sequence);

  Kms& kms_;
  const Route& route_;
  bool atomic_;
  Nanoseconds patience_;
  std::uint32_t fb_property_ = 0;
  bool counted_ = false;
  bool began_ = false;
  std::uint64_t token_ = 0;
  std::uint64_t refresh_ = 0;
};

/// Makes a route show framebuffer `fb` in its mode. Sets everything between framebuffer and cable to
/// identity, and reads it all back. Less important properties that cannot be identity become `warnings`.
/// blobs: created here; the caller destroys them.
/// fails: device_refused (the mode, or a property that changes pixels), device_lost, limit.
struct Takeover {
  Kms& kms;
  const Route& route;
  SavedScreen& saved;
  std::vector<std::string>& warnings;
  std::vector<std::uint32_t>& blobs;

  /// With one atomic commit, which is tested first.
  Result<void> atomic(std::uint32_t fb);
  /// With single calls, for drivers without atomic commits.
  Result<void> legacy(std::uint32_t fb);

 private:
  Result<std::vector<IdentityValue>> identities();
  Result<std::vector<Setting>> base_settings(std::uint32_t fb);
  Result<void> cannot(const IdentityValue& identity);
  Result<void> verify(std::span<const Setting> settings, std::span<const IdentityValue> kept);
  Result<void> straighten_gamma();
};

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
