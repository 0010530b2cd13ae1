// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/base/files.hpp"
#include "symrig/projector/internal/drm.hpp"
#include "symrig/projector/internal/kms.hpp"

#include <map>

namespace symrig::projector::drm {

/// A card of this computer, through libdrm.
class LibdrmKms final : public Kms {
 public:
  LibdrmKms(Fd card, const std::string& name);
  ~LibdrmKms() override;

  std::string driver() override;
  Errno become_master() override;
  bool is_master() override;
  void drop_master() override;
  bool enable_atomic() override;

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
  Errno hide_cursor(std::uint32_t crtc) override;
  KernelAnswer<Gamma> gamma(std::uint32_t crtc, int size) override;
  Errno set_gamma(std::uint32_t crtc, const Gamma& gamma) override;

  Errno counts_refreshes(std::uint32_t crtc) override;
  KernelAnswer<FlipEvent> next_flip(Nanoseconds patience) override;
  bool hotplugged(std::uint32_t connector) override;
  SteadyTime now() override;
  void sleep_until(SteadyTime time) override;

 private:
  int fd() const { return card_.get(); }
  KernelAnswer<Plane> plane(std::uint32_t id);
  const Property& kind_of(std::uint32_t property);

  Fd card_;
  FlipEvents events_;
  HotplugListener hotplug_;
  std::map<std::uint32_t, Property> kinds_;  // properties that were read before, without their values
};

}  // namespace symrig::projector::drm
