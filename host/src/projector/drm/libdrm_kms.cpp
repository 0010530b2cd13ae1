// SPDX-License-Identifier: Apache-2.0

#include "projector/drm/libdrm_kms.hpp"

#include "symrig/base/files.hpp"
#include "symrig/base/time.hpp"

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <ctime>

#include <drm_fourcc.h>
#include <fmt/format.h>
#include <sys/mman.h>
#include <xf86drm.h>

namespace symrig::projector::drm {
namespace {

/// Most libdrm functions return −errno. Some return −1 and set errno.
Errno errno_of(int answer) {
  if (answer >= 0) return 0;
  return answer == -1 ? errno : -answer;
}

struct FreeRequest {
  void operator()(drmModeAtomicReq* request) const { drmModeAtomicFree(request); }
};
using Request = std::unique_ptr<drmModeAtomicReq, FreeRequest>;

std::uint32_t flags_of(Commit how) {
  switch (how) {
    case Commit::test:
      return DRM_MODE_ATOMIC_TEST_ONLY | DRM_MODE_ATOMIC_ALLOW_MODESET;
    case Commit::modeset:
      return DRM_MODE_ATOMIC_ALLOW_MODESET;
    case Commit::flip:
      return DRM_MODE_ATOMIC_NONBLOCK | DRM_MODE_PAGE_FLIP_EVENT;
  }
  return 0;
}

/// The kernel returns user data unchanged, so it need not be a valid pointer.
void* as_user_data(std::uint64_t token) {
  return reinterpret_cast<void*>(token);  // NOLINT(performance-no-int-to-ptr)
}

}  // namespace

LibdrmKms::LibdrmKms(Fd card, const std::string& name) : card_(std::move(card)), hotplug_(name) {}

LibdrmKms::~LibdrmKms() = default;

std::string LibdrmKms::driver() {
  drmVersion* version = drmGetVersion(fd());
  if (version == nullptr) return "unknown";
  std::string name(version->name, static_cast<std::size_t>(version->name_len));
  drmFreeVersion(version);
  return name;
}

Errno LibdrmKms::become_master() {
  return drmIsMaster(fd()) != 0 ? 0 : errno_of(drmSetMaster(fd()));
}

bool LibdrmKms::is_master() {
  return drmIsMaster(fd()) != 0;
}

void LibdrmKms::drop_master() {
  drmDropMaster(fd());
}

bool LibdrmKms::enable_atomic() {
  drmSetClientCap(fd(), DRM_CLIENT_CAP_UNIVERSAL_PLANES, 1);
  return drmSetClientCap(fd(), DRM_CLIENT_CAP_ATOMIC, 1) == 0;
}

KernelAnswer<std::uint32_t> LibdrmKms::create_blob(std::span<const std::byte> bytes) {
  std::uint32_t id = 0;
  const Errno error = errno_of(drmModeCreatePropertyBlob(fd(), bytes.data(), bytes.size(), &id));
  return {error, id};
}

void LibdrmKms::destroy_blob(std::uint32_t id) {
  drmModeDestroyPropertyBlob(fd(), id);
}

KernelAnswer<Buffer> LibdrmKms::create_buffer(Grid grid) {
  const auto width = static_cast<std::uint32_t>(grid.cols);
  const auto height = static_cast<std::uint32_t>(grid.rows);
  KernelAnswer<Buffer> answer;
  Buffer& buffer = answer.value;
  std::uint32_t pitch = 0;
  std::uint64_t bytes = 0, offset = 0;
  answer.error =
      errno_of(drmModeCreateDumbBuffer(fd(), width, height, 32, 0, &buffer.handle, &pitch, &bytes));
  if (!answer) return answer;
  const std::uint32_t handles[4] = {buffer.handle}, pitches[4] = {pitch}, offsets[4] = {};
  answer.error = errno_of(
      drmModeAddFB2(fd(), width, height, DRM_FORMAT_XRGB8888, handles, pitches, offsets, &buffer.fb, 0));
  if (answer) answer.error = errno_of(drmModeMapDumbBuffer(fd(), buffer.handle, &offset));
  void* memory =
      answer ? ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, fd(), static_cast<off_t>(offset))
             : MAP_FAILED;
  if (answer && memory == MAP_FAILED) answer.error = errno;
  if (answer) {
    buffer.pitch = pitch / sizeof(std::uint32_t);
    buffer.words = {static_cast<std::uint32_t*>(memory), bytes / sizeof(std::uint32_t)};
  } else {
    destroy_buffer(buffer);
  }
  return answer;
}

void LibdrmKms::destroy_buffer(const Buffer& buffer) {
  if (!buffer.words.empty()) ::munmap(buffer.words.data(), buffer.words.size_bytes());
  if (buffer.fb != 0) drmModeRmFB(fd(), buffer.fb);
  if (buffer.handle != 0) drmModeDestroyDumbBuffer(fd(), buffer.handle);
}

Errno LibdrmKms::commit(std::span<const Setting> settings, Commit how, std::uint64_t token) {
  const Request request(drmModeAtomicAlloc());
  if (!request) return ENOMEM;
  for (const Setting& setting : settings) {
    const int added =
        drmModeAtomicAddProperty(request.get(), setting.object, setting.property, setting.value);
    if (added < 0) return errno_of(added);
  }
  return errno_of(drmModeAtomicCommit(fd(), request.get(), flags_of(how), as_user_data(token)));
}

Errno LibdrmKms::set_crtc(const Crtc& crtc, std::span<const std::uint32_t> connectors) {
  std::vector<std::uint32_t> ids(connectors.begin(), connectors.end());
  drmModeModeInfo mode = crtc.mode.value_or(drmModeModeInfo{});
  return errno_of(drmModeSetCrtc(fd(), crtc.id, crtc.mode ? crtc.fb : 0, crtc.x, crtc.y,
                                 crtc.mode ? ids.data() : nullptr,
                                 crtc.mode ? static_cast<int>(ids.size()) : 0, crtc.mode ? &mode : nullptr));
}

Errno LibdrmKms::set_property(const Setting& setting) {
  return errno_of(drmModeObjectSetProperty(fd(), setting.object, static_cast<std::uint32_t>(setting.kind),
                                           setting.property, setting.value));
}

Errno LibdrmKms::page_flip(std::uint32_t crtc, std::uint32_t fb, std::uint64_t token) {
  return errno_of(drmModePageFlip(fd(), crtc, fb, DRM_MODE_PAGE_FLIP_EVENT, as_user_data(token)));
}

Errno LibdrmKms::disable_plane(std::uint32_t plane) {
  return errno_of(drmModeSetPlane(fd(), plane, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0));
}

Errno LibdrmKms::hide_cursor(std::uint32_t crtc) {
  return errno_of(drmModeSetCursor(fd(), crtc, 0, 0, 0));
}

KernelAnswer<Gamma> LibdrmKms::gamma(std::uint32_t crtc, int size) {
  const std::size_t count = size;
  Gamma gamma{std::vector<std::uint16_t>(count), std::vector<std::uint16_t>(count),
              std::vector<std::uint16_t>(count)};
  const Errno error = errno_of(drmModeCrtcGetGamma(fd(), crtc, static_cast<std::uint32_t>(size),
                                                   gamma.red.data(), gamma.green.data(), gamma.blue.data()));
  return {error, std::move(gamma)};
}

Errno LibdrmKms::set_gamma(std::uint32_t crtc, const Gamma& gamma) {
  Gamma copy = gamma;  // libdrm takes pointers to non-const tables
  return errno_of(drmModeCrtcSetGamma(fd(), crtc, static_cast<std::uint32_t>(copy.red.size()),
                                      copy.red.data(), copy.green.data(), copy.blue.data()));
}

Errno LibdrmKms::counts_refreshes(std::uint32_t crtc) {
  std::uint64_t sequence = 0, stamp = 0;
  return errno_of(drmCrtcGetSequence(fd(), crtc, &sequence, &stamp));
}

KernelAnswer<FlipEvent> LibdrmKms::next_flip(Nanoseconds patience) {
  return events_.next(fd(), patience);
}

bool LibdrmKms::hotplugged(std::uint32_t connector) {
  return hotplug_.received(connector);
}

SteadyTime LibdrmKms::now() {
  return {steady_now()};
}

void LibdrmKms::sleep_until(SteadyTime time) {
  const std::int64_t ns = time.since.count();
  const timespec until{.tv_sec = ns / 1'000'000'000, .tv_nsec = ns % 1'000'000'000};
  while (::clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) == EINTR) {
  }
}

// The objects of a card: connectors, CRTCs, planes and their properties. What follows copies libdrm's lists
// and frees them at once.

namespace {

/// Frees what libdrm allocated, with libdrm's own function.
template <auto free_it>
struct Freer {
  template <class T>
  void operator()(T* pointer) const {
    free_it(pointer);
  }
};
template <class T, auto free_it>
using Owned = std::unique_ptr<T, Freer<free_it>>;

/// A list from libdrm. Its count is an int in some structures and unsigned in others.
template <class T, class Count>
std::span<const T> list(const T* items, Count count) {
  return {items, items == nullptr ? 0 : static_cast<std::size_t>(count)};
}

template <class T, class Count>
std::vector<T> copy(const T* items, Count count) {
  const auto all = list(items, count);
  return {all.begin(), all.end()};
}

/// errno of a libdrm call that has just returned null.
Errno last_error() {
  return errno != 0 ? errno : EIO;
}

std::string connector_name(const drmModeConnector& connector) {
  const char* type = drmModeGetConnectorTypeName(connector.connector_type);
  return fmt::format("{}-{}", type != nullptr ? type : "Unknown", connector.connector_type_id);
}

std::uint32_t current_crtc(int fd, const drmModeConnector& connector) {
  if (connector.encoder_id == 0) return 0;
  const Owned<drmModeEncoder, drmModeFreeEncoder> encoder(drmModeGetEncoder(fd, connector.encoder_id));
  return encoder ? encoder->crtc_id : 0;
}

Property describe_property(const drmModePropertyRes& raw) {
  Property property;
  property.id = raw.prop_id;
  property.name = std::string(raw.name, strnlen(raw.name, sizeof raw.name));
  property.immutable = (raw.flags & DRM_MODE_PROP_IMMUTABLE) != 0;
  const std::uint32_t type = drmModeGetPropertyType(&raw);
  property.blob = type == DRM_MODE_PROP_BLOB;
  for (const auto& choice : list(raw.enums, raw.count_enums))
    property.choices.emplace_back(
        std::string(choice.name, strnlen(choice.name, sizeof choice.name)),
        type == DRM_MODE_PROP_BITMASK ? std::uint64_t{1} << choice.value : choice.value);
  if ((type == DRM_MODE_PROP_RANGE || type == DRM_MODE_PROP_SIGNED_RANGE) && raw.count_values == 2)
    property.range = {{raw.values[0], raw.values[1]}};
  return property;
}

}  // namespace

KernelAnswer<Resources> LibdrmKms::resources() {
  errno = 0;
  const Owned<drmModeRes, drmModeFreeResources> raw(drmModeGetResources(fd()));
  if (!raw) return {last_error(), {}};
  return {0, {copy(raw->crtcs, raw->count_crtcs), copy(raw->connectors, raw->count_connectors)}};
}

KernelAnswer<Connector> LibdrmKms::connector(std::uint32_t id, bool probe) {
  errno = 0;
  const Owned<drmModeConnector, drmModeFreeConnector> raw(probe ? drmModeGetConnector(fd(), id)
                                                                : drmModeGetConnectorCurrent(fd(), id));
  if (!raw) return {last_error(), {}};
  Connector connector;
  connector.id = id;
  connector.name = connector_name(*raw);
  connector.connected = raw->connection == DRM_MODE_CONNECTED;
  connector.modes = copy(raw->modes, raw->count_modes);
  connector.possible_crtcs = drmModeConnectorGetPossibleCrtcs(fd(), raw.get());
  connector.crtc = current_crtc(fd(), *raw);
  return {0, std::move(connector)};
}

KernelAnswer<Crtc> LibdrmKms::crtc(std::uint32_t id) {
  errno = 0;
  const Owned<drmModeCrtc, drmModeFreeCrtc> raw(drmModeGetCrtc(fd(), id));
  if (!raw) return {last_error(), {}};
  Crtc crtc{.id = id, .fb = raw->buffer_id, .x = raw->x, .y = raw->y, .gamma_size = raw->gamma_size};
  if (raw->mode_valid != 0) crtc.mode = raw->mode;
  return {0, crtc};
}

KernelAnswer<Plane> LibdrmKms::plane(std::uint32_t id) {
  errno = 0;
  const Owned<drmModePlane, drmModeFreePlane> raw(drmModeGetPlane(fd(), id));
  if (!raw) return {last_error(), {}};
  return {0, {id, raw->possible_crtcs, raw->crtc_id, copy(raw->formats, raw->count_formats)}};
}

KernelAnswer<std::vector<Plane>> LibdrmKms::planes() {
  errno = 0;
  const Owned<drmModePlaneRes, drmModeFreePlaneResources> raw(drmModeGetPlaneResources(fd()));
  if (!raw) return {last_error(), {}};
  KernelAnswer<std::vector<Plane>> planes;
  for (const std::uint32_t id : list(raw->planes, raw->count_planes)) {
    auto found = plane(id);
    if (!found) return {found.error, {}};
    planes.value.push_back(std::move(found.value));
  }
  return planes;
}

const Property& LibdrmKms::kind_of(std::uint32_t property) {
  const auto known = kinds_.find(property);
  if (known != kinds_.end()) return known->second;
  const Owned<drmModePropertyRes, drmModeFreeProperty> raw(drmModeGetProperty(fd(), property));
  return kinds_.emplace(property, raw ? describe_property(*raw) : Property{.id = property}).first->second;
}

KernelAnswer<std::vector<Property>> LibdrmKms::properties(std::uint32_t object, ObjectKind kind) {
  errno = 0;
  const Owned<drmModeObjectProperties, drmModeFreeObjectProperties> raw(
      drmModeObjectGetProperties(fd(), object, static_cast<std::uint32_t>(kind)));
  if (!raw) return {last_error(), {}};
  KernelAnswer<std::vector<Property>> properties;
  const auto values = list(raw->prop_values, raw->count_props);
  for (std::size_t k = 0; k < values.size(); ++k) {
    properties.value.push_back(kind_of(raw->props[k]));
    properties.value.back().value = values[k];
  }
  return properties;
}

KernelAnswer<std::vector<std::byte>> LibdrmKms::blob(std::uint32_t id) {
  errno = 0;
  const Owned<drmModePropertyBlobRes, drmModeFreePropertyBlob> raw(drmModeGetPropertyBlob(fd(), id));
  if (!raw) return {last_error(), {}};
  return {0, copy(static_cast<const std::byte*>(raw->data), raw->length)};
}

}  // namespace symrig::projector::drm
