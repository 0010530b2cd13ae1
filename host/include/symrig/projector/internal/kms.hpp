// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/result.hpp"
#include "symrig/base/time.hpp"
#include "symrig/board/clock_model.hpp"
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

/// The part of the kernel's mode setting (KMS) that a projector needs.
namespace symrig::projector::drm {

/// The kernel's answer: 0, or an errno.
using Errno = int;

template <class T>
struct KernelAnswer {
  Errno error = 0;
  T value{};
  explicit operator bool() const { return error == 0; }
};

enum class ObjectKind : std::uint32_t {
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
  std::uint32_t possible_crtcs = 0;  // bit k: the connector can use Resources::crtcs[k]
  std::uint32_t crtc = 0;            // the CRTC that drives it now, 0 = none
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
  std::uint32_t crtc = 0;  // the CRTC that shows it now, 0 = none
  std::vector<std::uint32_t> formats;
};

struct Property {
  std::uint32_t id = 0;
  std::string name = {};
  std::uint64_t value = 0;
  bool immutable = false;
  bool blob = false;  // the value is a blob's id, 0 = none
  std::vector<std::pair<std::string, std::uint64_t>> choices =
      {};  // name and value, for enumerations and bit masks
  std::optional<std::pair<std::uint64_t, std::uint64_t>> range = {};
};

/// A value for one property of one object.
struct Setting {
  std::uint32_t object = 0;
  ObjectKind kind = ObjectKind::crtc;
  std::uint32_t property = 0;
  std::uint64_t value = 0;
};

/// Graphics memory that the CPU can write and a plane can show. Valid until destroy_buffer().
struct Buffer {
  std::uint32_t handle = 0;
  std::uint32_t fb = 0;
  std::size_t pitch = 0;                // words per row
  std::span<std::uint32_t> words = {};  // XRGB8888
};

struct FlipEvent {
  std::uint64_t token = 0;
  std::uint32_t sequence = 0;
  SteadyTime stamp;
};

enum class Commit : std::uint8_t {
  test,     // checks the commit, changes nothing
  modeset,  // takes effect at once, may blank the screen
  flip      // takes effect at the next refresh and sends an event
};

struct Gamma {
  std::vector<std::uint16_t> red, green, blue;
  bool operator==(const Gamma&) const = default;
};

/// An open graphics card. Not thread-safe. The destructor closes the file, and the kernel then frees all
/// remaining objects.
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
  /// Makes all planes visible and asks for atomic commits. false: the driver has no atomic commits.
  virtual bool enable_atomic() = 0;

  virtual KernelAnswer<Resources> resources() = 0;
  /// probe = true: queries the display again (tens of milliseconds). false: returns what the kernel knows.
  virtual KernelAnswer<Connector> connector(std::uint32_t id, bool probe) = 0;
  virtual KernelAnswer<Crtc> crtc(std::uint32_t id) = 0;
  virtual KernelAnswer<std::vector<Plane>> planes() = 0;
  virtual KernelAnswer<std::vector<Property>> properties(std::uint32_t object, ObjectKind kind) = 0;
  virtual KernelAnswer<std::vector<std::byte>> blob(std::uint32_t id) = 0;
  virtual KernelAnswer<std::uint32_t> create_blob(std::span<const std::byte> bytes) = 0;
  virtual void destroy_blob(std::uint32_t id) = 0;

  virtual KernelAnswer<Buffer> create_buffer(Grid grid) = 0;
  virtual void destroy_buffer(const Buffer& buffer) = 0;

  virtual Errno commit(std::span<const Setting> settings, Commit how, std::uint64_t token) = 0;
  /// Without crtc.mode: switches the CRTC off.
  virtual Errno set_crtc(const Crtc& crtc, std::span<const std::uint32_t> connectors) = 0;
  virtual Errno set_property(const Setting& setting) = 0;
  virtual Errno page_flip(std::uint32_t crtc, std::uint32_t fb, std::uint64_t token) = 0;
  virtual Errno disable_plane(std::uint32_t plane) = 0;
  virtual Errno hide_cursor(std::uint32_t crtc) = 0;
  virtual KernelAnswer<Gamma> gamma(std::uint32_t crtc, int size) = 0;
  virtual Errno set_gamma(std::uint32_t crtc, const Gamma& gamma) = 0;

  /// Asks if the card counts refreshes: 0, or EOPNOTSUPP.
  virtual Errno counts_refreshes(std::uint32_t crtc) = 0;
  /// The next flip event. ETIMEDOUT after `patience`.
  virtual KernelAnswer<FlipEvent> next_flip(Nanoseconds patience) = 0;
  /// true: since the last call, the kernel has reported a hot-plug at this card, at `connector` or at an
  /// unnamed connector.
  virtual bool hotplugged(std::uint32_t connector) = 0;
  virtual SteadyTime now() = 0;
  virtual void sleep_until(SteadyTime time) = 0;
};

/// The graphics cards of a computer.
class Cards {
 public:
  Cards() = default;
  Cards(const Cards&) = delete;
  Cards& operator=(const Cards&) = delete;
  virtual ~Cards() = default;

  /// "card0", …
  virtual std::vector<std::string> names() = 0;
  /// fails: device_lost (no permission, removed), device_refused (no display outputs).
  virtual Result<std::unique_ptr<Kms>> open(const std::string& card) = 0;
  /// Programs that have the card open, as far as this user may see them: "Xorg (1234)".
  virtual std::vector<std::string> holders(const std::string& card) = 0;
};

/// This computer's cards: /dev/dri.
std::unique_ptr<Cards> machine_cards();

}  // namespace symrig::projector::drm
