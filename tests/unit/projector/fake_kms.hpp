// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/projector/internal/drm_projector.hpp"
#include "symrig/projector/internal/kms.hpp"

#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace symrig::projector::drm::test {

/// A mode with round timings: a quarter and a third of blanking.
drmModeModeInfo make_mode(int cols, int rows, double rate, bool preferred = false, std::uint32_t flags = 0);

/// One card with CRTCs, connectors and planes, in a time of its own that moves only when somebody waits. It
/// scans out what a driver would: the framebuffer of the last flip, from the next refresh on.
struct FakeCard {
  std::string driver = "fake";
  bool has_atomic = true;
  bool counts = true;       // refreshes, in events and when asked
  int stuck_master = 0;     // this many attempts to become master fail
  std::size_t memory = 16;  // buffers that fit

  std::map<std::uint32_t, Connector> connectors;
  std::map<std::uint32_t, Crtc> crtcs;
  std::map<std::uint32_t, Plane> planes;
  std::map<std::uint32_t, std::vector<Property>> properties;  // of each object
  std::map<std::uint32_t, std::vector<std::byte>> blobs;
  std::map<std::uint32_t, Gamma> gammas;
  std::set<std::string> refused;  // setting a property of these names fails
  std::set<std::string> ignored;  // … is accepted and changes nothing

  // Faults, asked at each call.
  std::function<Errno(std::uint64_t flip)> on_flip;              // the number of the flip, from 1
  std::function<void(std::uint64_t flip, FlipEvent&)> on_event;  // may change what the kernel tells
  std::function<bool(std::uint64_t flip)> lose_event;
  std::function<void()> on_delivery;  // after an event was told
  bool gone = false;                  // every call answers ENODEV
  bool hotplug = false;               // told once
  Nanoseconds early{};                // events come so long before the refresh that they tell of

  // What has happened.
  SteadyTime time{Nanoseconds{1'000'000'000}};
  std::uint64_t flips = 0;
  std::uint64_t sequence_offset = 100;
  int open_files = 0;
  int masters = 0;
  int live_buffers = 0;
  std::uint32_t next_id = 1000;
  std::map<std::uint32_t, std::vector<std::uint32_t>> memory_of;  // framebuffer → words
  std::map<std::uint32_t, std::size_t> pitch_of;

  /// One CRTC (11), one connector (21, HDMI-A-1, plugged in), a primary plane (31), with atomic properties.
  static FakeCard with_one_display();
  Property& property(std::uint32_t object, const std::string& name);
  void add_property(std::uint32_t object, Property property);
  /// The pixels that leave the connector's CRTC now, without the unused top byte.
  std::vector<std::uint32_t> scanned_out(std::uint32_t crtc = 11) const;
};

class FakeKms final : public Kms {
 public:
  explicit FakeKms(std::shared_ptr<FakeCard> card);
  ~FakeKms() override;

  std::string driver() override { return card_->driver; }
  Errno become_master() override;
  bool is_master() override { return master_; }
  void drop_master() override;
  bool enable_atomic() override { return card_->has_atomic; }
  KernelAnswer<Resources> resources() override;
  KernelAnswer<Connector> connector(std::uint32_t id, bool probe) override;
  KernelAnswer<Crtc> crtc(std::uint32_t id) override;
  KernelAnswer<std::vector<Plane>> planes() override;
  KernelAnswer<std::vector<Property>> properties(std::uint32_t object, ObjectKind kind) override;
  KernelAnswer<std::vector<std::byte>> blob(std::uint32_t id) override;
  KernelAnswer<std::uint32_t> create_blob(std::span<const std::byte> bytes) override;
  void destroy_blob(std::uint32_t id) override;
  KernelAnswer<Buffer> create_buffer(Grid grid) override;
  void destroy_buffer(const Buffer& buffer) override;
  Errno commit(std::span<const Setting> settings, Commit how, std::uint64_t token) override;
  Errno set_crtc(const Crtc& crtc, std::span<const std::uint32_t> connectors) override;
  Errno set_property(const Setting& setting) override;
  Errno page_flip(std::uint32_t crtc, std::uint32_t fb, std::uint64_t token) override;
  Errno disable_plane(std::uint32_t plane) override;
  Errno hide_cursor(std::uint32_t) override { return 0; }
  KernelAnswer<Gamma> gamma(std::uint32_t crtc, int size) override;
  Errno set_gamma(std::uint32_t crtc, const Gamma& gamma) override;
  Errno counts_refreshes(std::uint32_t crtc) override;
  KernelAnswer<FlipEvent> next_flip(Nanoseconds patience) override;
  bool hotplugged(std::uint32_t connector) override;
  SteadyTime now() override { return card_->time; }
  void sleep_until(SteadyTime time) override { card_->time = std::max(card_->time, time); }

 private:
  struct Pending {
    std::uint32_t crtc = 0;
    std::uint32_t fb = 0;
    FlipEvent event;
    bool lost = false;
  };
  Errno start_flip(std::uint32_t crtc, std::uint32_t fb, std::uint64_t token);
  Errno apply(const Setting& setting, bool test);
  Property* find(const Setting& setting);

  std::shared_ptr<FakeCard> card_;
  bool master_ = false;
  std::optional<Pending> pending_;
};

/// A machine with these cards, card0, card1, …
class FakeCards final : public Cards {
 public:
  explicit FakeCards(std::vector<std::shared_ptr<FakeCard>> cards) : cards_(std::move(cards)) {}
  explicit FakeCards(const std::shared_ptr<FakeCard>& card) : cards_{card} {}

  std::vector<std::string> names() override;
  Result<std::unique_ptr<Kms>> open(const std::string& card) override;
  std::vector<std::string> holders(const std::string&) override { return held_by; }

  std::vector<std::string> held_by;
  std::map<std::string, Error> unopenable;

 private:
  std::vector<std::shared_ptr<FakeCard>> cards_;
};

/// A machine with one card and one display, and patterns for it.
class DrmBench : public ::testing::Test {
 protected:
  Result<std::unique_ptr<DrmProjector>> open() { return DrmProjector::open(cards, options); }

  /// Opens, loads `count` patterns and hands the projector over.
  std::unique_ptr<DrmProjector> opened(std::size_t count = 5) {
    auto projector = open();
    if (!projector) {
      ADD_FAILURE() << projector.error().line();
      return nullptr;
    }
    const auto loaded = (*projector)->load(patterns((*projector)->grid(), count));
    EXPECT_TRUE(loaded.ok()) << loaded.error().line();
    return *std::move(projector);
  }

  /// Pattern k is grey k+1 of 255 everywhere but for one white pixel.
  static std::vector<Pattern> patterns(Grid grid, std::size_t count) {
    std::vector<Pattern> made;
    for (std::size_t k = 0; k < count; ++k) {
      made.emplace_back(grid, 1, static_cast<float>(k + 1) / 255.F);
      made.back().values()[k] = 1;
    }
    return made;
  }

  /// What pattern k must look like on the screen.
  std::vector<std::uint32_t> wanted(const DrmProjector& projector, std::size_t k) const {
    const auto codes = to_codes(patterns(projector.grid(), k + 1)[k], projector.grid(), {}, k);
    const auto picture = draw(*codes, options.placement, projector.screen());
    std::vector<std::uint32_t> pixels;
    for (const std::uint8_t code : picture.values()) pixels.push_back(0x010101U * code);
    return pixels;
  }

  std::shared_ptr<FakeCard> card = std::make_shared<FakeCard>(FakeCard::with_one_display());
  FakeCards cards{card};
  DrmProjectorOptions options;
};

}  // namespace symrig::projector::drm::test
