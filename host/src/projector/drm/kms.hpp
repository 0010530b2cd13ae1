// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/units.hpp"
#include "symrig/board/clock_time.hpp"
#include "symrig/image/grid.hpp"

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <xf86drmMode.h>

/// The kernel's mode setting (KMS), as much of it as a projector needs.
namespace symrig::projector::drm {

/// What the kernel answered: 0, or the errno with which it refused.
using Errno = int;

template <class T>
struct Answer {
  Errno error = 0;
  T value{};
  explicit operator bool() const { return error == 0; }
};

enum class Kind : std::uint32_t {
  crtc = DRM_MODE_OBJECT_CRTC,
  connector = DRM_MODE_OBJECT_CONNECTOR,
  plane = DRM_MODE_OBJECT_PLANE
};

struct Resources {
  std::vector<std::uint32_t> crtcs;
  std::vector<std::uint32_t> connectors;
};

struct Connector {
  std::uint32_t id = 0;
  std::string name;  // without the card: "HDMI-A-1"
  bool connected = false;
  std::vector<drmModeModeInfo> modes;
  std::uint32_t possible_crtcs = 0;  // bit k: the k-th of Resources::crtcs
  std::uint32_t crtc = 0;            // that drives it now, 0 = none
};

struct Crtc {
  std::uint32_t id = 0;
  std::uint32_t fb = 0;  // 0 = none
  std::uint32_t x = 0, y = 0;
  std::optional<drmModeModeInfo> mode = {};  // none: off
  int gamma_size = 0;
};

struct Plane {
  std::uint32_t id = 0;
  std::uint32_t possible_crtcs = 0;
  std::uint32_t crtc = 0;  // that shows it now, 0 = none
  std::vector<std::uint32_t> formats;
};

struct Property {
  std::uint32_t id = 0;
  std::string name = {};
  std::uint64_t value = 0;
  bool immutable = false;
  bool blob = false;  // the value is the id of one, 0 = none
  std::vector<std::pair<std::string, std::uint64_t>> choices =
      {};  // name and value, of enumerations and bit masks
  std::optional<std::pair<std::uint64_t, std::uint64_t>> range = {};
};

/// One value of one property of one object.
struct Setting {
  std::uint32_t object = 0;
  Kind kind = Kind::crtc;
  std::uint32_t property = 0;
  std::uint64_t value = 0;
};

/// Memory of the card that the CPU can write and a plane can show. Lives until destroy_buffer.
struct Buffer {
  std::uint32_t handle = 0;
  std::uint32_t fb = 0;
  std::size_t pitch = 0;                // words a row
  std::span<std::uint32_t> words = {};  // XRGB8888
};

struct FlipEvent {
  std::uint64_t token = 0;
  std::uint32_t sequence = 0;
  SteadyTime stamp;
};

enum class Commit : std::uint8_t {
  test,     // would it do? nothing changes
  modeset,  // at once, may blank the screen
  flip      // at the next refresh, with an event
};

struct Gamma {
  std::vector<std::uint16_t> red, green, blue;
  bool operator==(const Gamma&) const = default;
};

/// One card, opened. Not thread-safe. Its destructor closes the file: the kernel then takes back what is
/// still there.
class Kms {
 public:
  Kms() = default;
  Kms(const Kms&) = delete;
  Kms& operator=(const Kms&) = delete;
  virtual ~Kms() = default;

  virtual std::string driver() = 0;
  virtual Errno become_master() = 0;
  virtual bool is_master() = 0;
  virtual void drop_master() = 0;
  /// Shows all planes, and asks for atomic commits: false where the driver has none.
  virtual bool enable_atomic() = 0;

  virtual Answer<Resources> resources() = 0;
  /// probe: looks at the wire anew (tens of milliseconds), else what the kernel knows.
  virtual Answer<Connector> connector(std::uint32_t id, bool probe) = 0;
  virtual Answer<Crtc> crtc(std::uint32_t id) = 0;
  virtual Answer<std::vector<Plane>> planes() = 0;
  virtual Answer<std::vector<Property>> properties(std::uint32_t object, Kind kind) = 0;
  virtual Answer<std::vector<std::byte>> blob(std::uint32_t id) = 0;
  virtual Answer<std::uint32_t> create_blob(std::span<const std::byte> bytes) = 0;
  virtual void destroy_blob(std::uint32_t id) = 0;

  virtual Answer<Buffer> create_buffer(Grid grid) = 0;
  virtual void destroy_buffer(const Buffer& buffer) = 0;

  virtual Errno commit(std::span<const Setting> settings, Commit how, std::uint64_t token) = 0;
  /// crtc.mode none: off.
  virtual Errno set_crtc(const Crtc& crtc, std::span<const std::uint32_t> connectors) = 0;
  virtual Errno set_property(const Setting& setting) = 0;
  virtual Errno page_flip(std::uint32_t crtc, std::uint32_t fb, std::uint64_t token) = 0;
  virtual Errno disable_plane(std::uint32_t plane) = 0;
  virtual Errno hide_cursor(std::uint32_t crtc) = 0;
  virtual Answer<Gamma> gamma(std::uint32_t crtc, int size) = 0;
  virtual Errno set_gamma(std::uint32_t crtc, const Gamma& gamma) = 0;

  /// Does the card count refreshes? 0, or EOPNOTSUPP.
  virtual Errno counts_refreshes(std::uint32_t crtc) = 0;
  /// The next event of a flip; ETIMEDOUT after `patience`.
  virtual Answer<FlipEvent> next_flip(Nanoseconds patience) = 0;
  /// Has the kernel told since the last call that something was plugged in or out at this card, at
  /// `connector` or at one that it did not name?
  virtual bool hotplugged(std::uint32_t connector) = 0;
  virtual SteadyTime now() = 0;
  virtual void sleep_until(SteadyTime time) = 0;
};

/// The cards of a machine.
class Cards {
 public:
  Cards() = default;
  Cards(const Cards&) = delete;
  Cards& operator=(const Cards&) = delete;
  virtual ~Cards() = default;

  /// "card0", …
  virtual std::vector<std::string> names() = 0;
  /// fails: device_lost (no permission, gone), device_refused (it drives no display).
  virtual Result<std::unique_ptr<Kms>> open(const std::string& card) = 0;
  /// Programs that have the card open, as far as this user may see: "Xorg (1234)".
  virtual std::vector<std::string> holders(const std::string& card) = 0;
};

/// Those of this machine: /dev/dri.
std::unique_ptr<Cards> machine_cards();

}  // namespace symrig::projector::drm
