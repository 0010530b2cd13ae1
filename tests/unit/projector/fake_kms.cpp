// SPDX-License-Identifier: Apache-2.0
#include "fake_kms.hpp"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <stdexcept>
#include <utility>

#include <drm_fourcc.h>

namespace symrig::projector::drm::test {
namespace {

constexpr std::uint32_t kCrtc = 11, kConnector = 21, kPlane = 31, kCursor = 32;

Nanoseconds period_of(const FakeCard& card, std::uint32_t crtc) {
  const auto& mode = card.crtcs.at(crtc).mode;
  if (!mode) return Nanoseconds{16'666'667};
  return Nanoseconds(std::llround(1e6 * mode->htotal * mode->vtotal / mode->clock));
}

}  // namespace

drmModeModeInfo make_mode(int cols, int rows, double rate, bool preferred, std::uint32_t flags) {
  drmModeModeInfo mode{};
  const auto part = [](int whole, double share) {
    return static_cast<std::uint16_t>(std::lround(whole * share));
  };
  mode.hdisplay = part(cols, 1);
  mode.hsync_start = part(cols, 1.05);
  mode.hsync_end = part(cols, 1.1);
  mode.htotal = part(cols, 1.25);
  mode.vdisplay = part(rows, 1);
  mode.vsync_start = part(rows, 1.05);
  mode.vsync_end = part(rows, 1.1);
  mode.vtotal = part(rows, 4. / 3);
  mode.clock = static_cast<std::uint32_t>(std::lround(mode.htotal * mode.vtotal * rate / 1000));
  mode.vrefresh = static_cast<std::uint32_t>(std::lround(rate));
  mode.flags = flags;
  mode.type = preferred ? DRM_MODE_TYPE_PREFERRED : 0U;
  return mode;
}

FakeCard FakeCard::with_one_display() {
  FakeCard card;
  card.connectors[kConnector] = {
      kConnector, "HDMI-A-1",
      true,       {make_mode(64, 48, 60, true), make_mode(40, 30, 120), make_mode(40, 30, 60)},
      1,          0};
  card.crtcs[kCrtc] = Crtc{.id = kCrtc};
  card.planes[kPlane] = {kPlane, 1, 0, {DRM_FORMAT_XRGB8888}};
  card.planes[kCursor] = {kCursor, 1, kCrtc, {DRM_FORMAT_ARGB8888}};
  card.add_property(kConnector, {.name = "CRTC_ID"});
  for (const char* name : {"MODE_ID", "ACTIVE"}) card.add_property(kCrtc, {.name = name});
  for (const std::uint32_t plane : {kPlane, kCursor})
    for (const char* name :
         {"FB_ID", "CRTC_ID", "SRC_X", "SRC_Y", "SRC_W", "SRC_H", "CRTC_X", "CRTC_Y", "CRTC_W", "CRTC_H"})
      card.add_property(plane, {.name = name});
  card.property(kCursor, "FB_ID").value = 77;
  card.property(kCursor, "CRTC_ID").value = kCrtc;
  card.add_property(kPlane, {.name = "type", .value = DRM_PLANE_TYPE_PRIMARY, .immutable = true});
  card.add_property(kCursor, {.name = "type", .value = DRM_PLANE_TYPE_CURSOR, .immutable = true});
  return card;
}

void FakeCard::add_property(std::uint32_t object, Property property) {
  property.id = next_id++;
  properties[object].push_back(std::move(property));
}

Property& FakeCard::property(std::uint32_t object, const std::string& name) {
  auto& all = properties.at(object);
  const auto found =
      std::find_if(all.begin(), all.end(), [&](const auto& each) { return each.name == name; });
  if (found == all.end()) throw std::out_of_range(name);
  return *found;
}

std::vector<std::uint32_t> FakeCard::scanned_out(std::uint32_t crtc) const {
  const Crtc& state = crtcs.at(crtc);
  if (!state.mode || !memory_of.contains(state.fb)) return {};
  std::vector<std::uint32_t> pixels;
  for (std::size_t row = 0; row < state.mode->vdisplay; ++row)
    for (std::size_t col = 0; col < state.mode->hdisplay; ++col)
      pixels.push_back(memory_of.at(state.fb)[row * pitch_of.at(state.fb) + col] & 0x00FF'FFFFU);
  return pixels;
}

FakeKms::FakeKms(std::shared_ptr<FakeCard> card) : card_(std::move(card)) {
  ++card_->open_files;
}

FakeKms::~FakeKms() {
  drop_master();
  --card_->open_files;
}

Errno FakeKms::become_master() {
  if (card_->gone) return ENODEV;
  if (card_->stuck_master > 0) {
    --card_->stuck_master;
    return EBUSY;
  }
  if (!master_) ++card_->masters;
  master_ = true;
  return 0;
}

void FakeKms::drop_master() {
  if (master_) --card_->masters;
  master_ = false;
}

KernelAnswer<Resources> FakeKms::resources() {
  if (card_->gone) return {ENODEV, {}};
  KernelAnswer<Resources> answer;
  for (const auto& [id, crtc] : card_->crtcs) answer.value.crtcs.push_back(id);
  for (const auto& [id, connector] : card_->connectors) answer.value.connectors.push_back(id);
  return answer;
}

KernelAnswer<Connector> FakeKms::connector(std::uint32_t id, bool) {
  if (card_->gone) return {ENODEV, {}};
  return {0, card_->connectors.at(id)};
}

KernelAnswer<Crtc> FakeKms::crtc(std::uint32_t id) {
  if (card_->gone) return {ENODEV, {}};
  return {0, card_->crtcs.at(id)};
}

KernelAnswer<std::vector<Plane>> FakeKms::planes() {
  KernelAnswer<std::vector<Plane>> answer;
  for (const auto& [id, plane] : card_->planes) answer.value.push_back(plane);
  return answer;
}

KernelAnswer<std::vector<Property>> FakeKms::properties(std::uint32_t object, ObjectKind) {
  if (card_->gone) return {ENODEV, {}};
  return {0, card_->properties[object]};
}

KernelAnswer<std::vector<std::byte>> FakeKms::blob(std::uint32_t id) {
  const auto found = card_->blobs.find(id);
  return found == card_->blobs.end() ? KernelAnswer<std::vector<std::byte>>{ENOENT, {}}
                                     : KernelAnswer<std::vector<std::byte>>{0, found->second};
}

KernelAnswer<std::uint32_t> FakeKms::create_blob(std::span<const std::byte> bytes) {
  const std::uint32_t id = card_->next_id++;
  card_->blobs[id] = {bytes.begin(), bytes.end()};
  return {0, id};
}

void FakeKms::destroy_blob(std::uint32_t id) {
  card_->blobs.erase(id);
}

KernelAnswer<Buffer> FakeKms::create_buffer(Grid grid) {
  if (card_->live_buffers >= static_cast<int>(card_->memory)) return {ENOMEM, {}};
  ++card_->live_buffers;
  const std::uint32_t fb = card_->next_id++;
  const auto pitch = static_cast<std::size_t>(grid.cols) + 3;  // rows are rarely packed
  auto& words = card_->memory_of[fb];
  words.assign(pitch * static_cast<std::size_t>(grid.rows), 0xDEAD'BEEFU);
  card_->pitch_of[fb] = pitch;
  return {0, {fb, fb, pitch, words}};
}

void FakeKms::destroy_buffer(const Buffer& buffer) {
  --card_->live_buffers;
  card_->memory_of.erase(buffer.fb);
  for (auto& [id, crtc] : card_->crtcs)  // as the kernel: what is shown no more is off
    if (crtc.fb == buffer.fb) crtc = Crtc{.id = id, .gamma_size = crtc.gamma_size};
}

Property* FakeKms::find(const Setting& setting) {
  for (Property& property : card_->properties[setting.object])
    if (property.id == setting.property) return &property;
  return nullptr;
}

Errno FakeKms::apply(const Setting& setting, bool test) {
  Property* property = find(setting);
  if (property == nullptr) return ENOENT;
  if (property->immutable || card_->refused.contains(property->name)) return EINVAL;
  if (property->name == "DPMS" && card_->has_atomic) return EINVAL;
  if (property->blob && setting.value != 0 &&
      !card_->blobs.contains(static_cast<std::uint32_t>(setting.value)))
    return EINVAL;
  if (test || card_->ignored.contains(property->name)) return 0;
  property->value = setting.value;
  if (property->name == "FB_ID")
    card_->crtcs.at(kCrtc).fb =
        setting.object == kPlane ? static_cast<std::uint32_t>(setting.value) : card_->crtcs.at(kCrtc).fb;
  if (property->name == "MODE_ID" && setting.value != 0) {
    drmModeModeInfo mode{};
    std::memcpy(&mode, card_->blobs.at(static_cast<std::uint32_t>(setting.value)).data(), sizeof mode);
    card_->crtcs.at(setting.object).mode = mode;
  }
  if (property->name == "CRTC_ID" && setting.object == kConnector)
    card_->connectors.at(kConnector).crtc = static_cast<std::uint32_t>(setting.value);
  return 0;
}

Errno FakeKms::commit(std::span<const Setting> settings, Commit how, std::uint64_t token) {
  if (card_->gone) return ENODEV;
  if (!master_) return EACCES;
  if (how == Commit::flip) return start_flip(kCrtc, static_cast<std::uint32_t>(settings[0].value), token);
  for (const bool test : {true, false}) {
    if (!test && how == Commit::test) break;
    for (const Setting& setting : settings)
      if (const Errno error = apply(setting, test); error != 0) return error;
  }
  return 0;
}

Errno FakeKms::set_crtc(const Crtc& crtc, std::span<const std::uint32_t> connectors) {
  if (card_->gone) return ENODEV;
  if (!master_) return EACCES;
  const int gamma_size = card_->crtcs.at(crtc.id).gamma_size;
  card_->crtcs[crtc.id] = crtc;
  card_->crtcs[crtc.id].gamma_size = gamma_size;
  for (const std::uint32_t id : connectors) card_->connectors.at(id).crtc = crtc.id;
  return 0;
}

Errno FakeKms::set_property(const Setting& setting) {
  if (card_->gone) return ENODEV;
  const Property* property = find(setting);
  if (property != nullptr && property->name == "DPMS") {
    find(setting)->value = setting.value;
    return 0;
  }
  return apply(setting, false);
}

Errno FakeKms::page_flip(std::uint32_t crtc, std::uint32_t fb, std::uint64_t token) {
  if (card_->gone) return ENODEV;
  return master_ ? start_flip(crtc, fb, token) : EACCES;
}

/// The flip happens at the next refresh; refreshes are at whole multiples of the period.
Errno FakeKms::start_flip(std::uint32_t crtc, std::uint32_t fb, std::uint64_t token) {
  if (pending_) return EBUSY;
  const std::uint64_t number = ++card_->flips;
  if (card_->on_flip)
    if (const Errno error = card_->on_flip(number); error != 0) return error;
  const Nanoseconds period = period_of(*card_, crtc);
  const std::int64_t refresh = (card_->time.since + card_->early) / period + 1;
  FlipEvent event{token, 0, {refresh * period}};
  if (card_->counts)
    event.sequence = static_cast<std::uint32_t>(static_cast<std::uint64_t>(refresh) + card_->sequence_offset);
  else
    event.stamp = card_->time;
  if (card_->on_event) card_->on_event(number, event);
  pending_ = Pending{crtc, fb, event, card_->lose_event && card_->lose_event(number)};
  return 0;
}

Errno FakeKms::disable_plane(std::uint32_t plane) {
  card_->planes.at(plane).crtc = 0;
  return 0;
}

KernelAnswer<Gamma> FakeKms::gamma(std::uint32_t crtc, int size) {
  const std::size_t count = size;
  const auto found = card_->gammas.find(crtc);
  const std::vector<std::uint16_t> zero(count);
  return {0, found == card_->gammas.end() ? Gamma{zero, zero, zero} : found->second};
}

Errno FakeKms::set_gamma(std::uint32_t crtc, const Gamma& gamma) {
  if (card_->refused.contains("gamma")) return EINVAL;
  card_->gammas[crtc] = gamma;
  return 0;
}

Errno FakeKms::counts_refreshes(std::uint32_t) {
  return card_->counts ? 0 : EOPNOTSUPP;
}

KernelAnswer<FlipEvent> FakeKms::next_flip(Nanoseconds patience) {
  if (card_->gone) return {ENODEV, {}};
  if (!pending_ || pending_->lost || pending_->event.stamp - card_->early > card_->time + patience) {
    card_->time = card_->time + patience;
    return {ETIMEDOUT, {}};
  }
  const Pending done = *pending_;
  pending_.reset();
  card_->time = std::max(card_->time, done.event.stamp - card_->early);
  card_->crtcs.at(done.crtc).fb = done.fb;
  if (card_->on_delivery) card_->on_delivery();
  return {0, done.event};
}

bool FakeKms::hotplugged(std::uint32_t) {
  return std::exchange(card_->hotplug, false);
}

std::vector<std::string> FakeCards::names() {
  std::vector<std::string> names;
  for (std::size_t k = 0; k < cards_.size(); ++k)
    names.push_back(std::string("card").append(std::to_string(k)));
  return names;
}

Result<std::unique_ptr<Kms>> FakeCards::open(const std::string& card) {
  if (const auto error = unopenable.find(card); error != unopenable.end()) return error->second;
  return std::unique_ptr<Kms>(std::make_unique<FakeKms>(cards_.at(std::stoul(card.substr(4)))));
}

}  // namespace symrig::projector::drm::test
