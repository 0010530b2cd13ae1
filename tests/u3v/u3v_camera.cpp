// SPDX-License-Identifier: Apache-2.0

#include "u3v/u3v_camera.hpp"

#include <algorithm>
#include <array>
#include <initializer_list>
#include <utility>

namespace symrig::u3v {
namespace {

using Bytes = test::UsbDescription::Bytes;

void add(Bytes& to, std::initializer_list<std::uint8_t> bytes) {
  for (const std::uint8_t byte : bytes) to.push_back(byte);
}

/// A bulk endpoint of SuperSpeed with its companion.
void add_endpoint(Bytes& to, std::uint8_t address) {
  add(to, {7, 5, address, 2, 0x00, 0x04, 0});
  add(to, {6, 0x30, 0, 0, 0, 0});
}

Bytes configuration() {
  constexpr std::uint8_t kMisc = 0xEF, kVision = 5, kControl = 0, kStream = 2;
  Bytes all{9, 2, 0, 0, 2, 1, 0, 0x80, 62};
  add(all, {8, 0x0B, 0, 2, kMisc, kVision, kControl, 0});  // both interfaces are one function
  add(all, {9, 4, 0, 0, 2, kMisc, kVision, kControl, 0});
  // Versions of GenCP and of USB3 Vision, strings (GUID, maker, model, -, -, -, serial, -), speeds:
  // SuperSpeed.
  add(all, {20, 0x24, 1, 0, 0, 1, 0, 0, 0, 1, 0, 4, 1, 2, 0, 0, 0, 3, 0, 8});
  add_endpoint(all, 0x81);
  add_endpoint(all, 0x01);
  add(all, {9, 4, 1, 0, 1, kMisc, kVision, kStream, 0});
  add_endpoint(all, 0x82);
  all[2] = static_cast<std::uint8_t>(all.size());
  all[3] = static_cast<std::uint8_t>(all.size() >> 8U);
  return all;
}

}  // namespace

test::UsbDescription u3v_description(const std::string& serial) {
  test::UsbDescription described;
  described.name = "u3v";
  described.speed = test::UsbSpeed::super;
  // 1209:0002 is for tests (pid.codes). Class, subclass and protocol: interfaces are grouped.
  described.device = {18, 1, 0x00, 0x03, 0xEF, 2, 1, 9, 0x09, 0x12, 0x02, 0x00, 0, 1, 1, 2, 3, 1};
  described.configuration = configuration();
  described.strings = {"Symrig", "Loopback", serial, "1209" + serial};
  // The capabilities of USB 3.0, without link power states.
  described.others[0x0F] = {5, 0x0F, 22, 0, 2, 7, 0x10, 2, 0, 0, 0, 0, 10, 0x10, 3, 0, 8, 0, 3, 0, 0, 0};
  described.interface_classes = {0xEF, 5, 0, 0xEF, 5, 2};
  return described;
}

namespace {

using gige::Shot;
using Bytes = test::UsbDevice::Bytes;

// Blocks of registers: technology-agnostic ones at 0, those of USB3 Vision, of its stream, the list of XML
// files.
constexpr std::uint32_t kSbrm = 0x1000, kSirm = 0x2000, kManifest = 0x3000, kXmlAt = 0x20000;
constexpr std::uint32_t kTimestamp = 0x1F0, kLatch = 0x1F8;
constexpr std::uint32_t kStreamOn = kSirm + 0x04, kNeedsPayload = kSirm + 0x08, kPayloadSize = kSirm + 0x1C,
                        kPayloadCount = kSirm + 0x20, kLastSizes = kSirm + 0x24, kSirmEnd = kSirm + 0x30;
constexpr std::uint32_t kFeatures = 0x10000, kStart = 0x10018, kPayload = 0x10050, kChunkSelector = 0x10044,
                        kChunkEnable = 0x10048, kChunkEnables = 0x10070, kBinning = 0x10078,
                        kWidthMost = 0x10080, kHeightMost = 0x10084;
constexpr std::uint32_t kControlMagic = 0x43563355, kLeaderMagic = 0x4C563355, kTrailerMagic = 0x54563355;
constexpr std::size_t kHead = 12, kLeader = 52, kTrailer = 32;
constexpr std::uint32_t kLongestPacket = 1024;
enum Status : std::uint16_t {
  done = 0,
  not_implemented = 0x8001,
  invalid_parameter = 0x8002,
  invalid_address = 0x8003,
  write_protected = 0x8004
};

void put(Bytes& to, std::uint64_t value, int bytes) {
  for (int k = 0; k < bytes; ++k) to.push_back(static_cast<std::uint8_t>(value >> 8 * k));
}

std::uint64_t get(std::span<const std::uint8_t> from, std::size_t at, int bytes) {
  std::uint64_t value = 0;
  for (int k = bytes - 1; k >= 0; --k) value = value << 8U | from[at + static_cast<std::size_t>(k)];
  return value;
}

std::chrono::nanoseconds now() {
  return std::chrono::steady_clock::now().time_since_epoch();
}

std::uint64_t nanoseconds(std::chrono::nanoseconds time) {
  return static_cast<std::uint64_t>(time.count());
}

/// The host may write the stream's sizes, the latch and the features.
bool writable(std::uint64_t at) {
  return at >= kFeatures || (at >= kStreamOn && at < kSirmEnd) || at == kLatch;
}

}  // namespace

U3vCamera::U3vCamera(gige::CameraTraits traits, gige::GigeCamera::Scene scene, std::string serial)
    : traits_(std::move(traits)),
      scene_(std::move(scene)),
      serial_(std::move(serial)),
      xml_(gige::camera_xml(traits_, gige::Protocol::usb3_vision)),
      description_(u3v_description(serial_)),
      memory_(kXmlAt) {
  reset();
}

void U3vCamera::reset() {
  std::ranges::fill(memory_, std::uint8_t{0});
  answers_.clear();
  transfers_.clear();
  held_.reset();
  taken_ = 0;
  counter_ = 0;
  next_id_ = 0;
  set_bootstrap();
  set_defaults();
  update();
}

/// What the host reads before it knows the XML.
void U3vCamera::set_bootstrap() {
  constexpr std::uint32_t kVersion = 0x00010000;
  const auto name = [this](std::size_t at, const std::string& text) {
    std::ranges::copy(text, memory_.begin() + static_cast<std::ptrdiff_t>(at));
  };
  store(0, kVersion);
  name(0x04, "Symrig");
  name(0x44, "Loopback");
  name(0xC4, "1.0");
  name(0x144, serial_);
  store(0x1CC, 500);  // ms until it answers, at most
  store(0x1D0, kManifest, 8);
  store(0x1D8, kSbrm, 8);
  store(0x1FC, 1, 8);  // ns of a tick
  store(kSbrm, kVersion);
  store(kSbrm + 0x14, kLongestPacket);
  store(kSbrm + 0x18, kLongestPacket);
  store(kSbrm + 0x1C, 1);  // streams
  store(kSbrm + 0x20, kSirm, 8);
  store(kSbrm + 0x28, kSirmEnd - kSirm);
  store(kSbrm + 0x40, 8);   // SuperSpeed
  store(kSirm, 2U << 24U);  // sizes of transfers are multiples of 1 << 2
  store(kSirm + 0x10, kLeader);
  store(kSirm + 0x14, kTrailer);
  store(kManifest, 1, 8);              // files
  store(kManifest + 0x08, 1U << 24U);  // version; the next word is 0: not compressed
  store(kManifest + 0x10, kXmlAt, 8);
  store(kManifest + 0x18, xml_.size(), 8);
}

void U3vCamera::set_defaults() {
  store(0x10000, static_cast<std::uint32_t>(traits_.cols));
  store(0x10004, static_cast<std::uint32_t>(traits_.rows));
  store(0x10010, 0x01080001);
  store(0x10030, 10'000'000);
  store(0x10058, nanoseconds(traits_.readout));
  store(0x10034, 7'000);  // a delay that another program left
  store(0x10088, 1);      // and its overlap
  store(kBinning, 1);
  store(kBinning + 4, 1);
}

void U3vCamera::store(std::uint32_t at, std::uint64_t value, int bytes) {
  for (int k = 0; k < bytes; ++k)
    memory_[at + static_cast<std::uint32_t>(k)] = static_cast<std::uint8_t>(value >> 8 * k);
}

std::uint32_t U3vCamera::reg(std::uint32_t at) const {
  return static_cast<std::uint32_t>(get(memory_, at, 4));
}

/// Registers that follow from others.
void U3vCamera::update() {
  store(kWidthMost, static_cast<std::uint32_t>(traits_.cols) / std::max(1U, reg(kBinning)));
  store(kHeightMost, static_cast<std::uint32_t>(traits_.rows) / std::max(1U, reg(kBinning + 4)));
  store(kChunkEnable, reg(kChunkEnables + 4 * (reg(kChunkSelector) & 1U)));
  store(kPayload, payload_bytes());
  store(kNeedsPayload, payload_bytes(), 8);
}

std::optional<Bytes> U3vCamera::read(std::uint64_t at, std::size_t count) const {
  const bool in_xml = at >= kXmlAt;
  const std::uint64_t begin = in_xml ? at - kXmlAt : at, size = in_xml ? xml_.size() : memory_.size();
  if (begin > size || count > size - begin) return std::nullopt;
  Bytes bytes(count);
  for (std::size_t k = 0; k < count; ++k)
    bytes[k] = in_xml ? static_cast<std::uint8_t>(xml_[begin + k]) : memory_[begin + k];
  return bytes;
}

std::uint16_t U3vCamera::write(std::uint64_t at, std::span<const std::uint8_t> bytes) {
  if (at >= memory_.size() || bytes.size() > memory_.size() - at) return invalid_address;
  if (!writable(at)) return write_protected;
  std::ranges::copy(bytes, memory_.begin() + static_cast<std::ptrdiff_t>(at));
  written(static_cast<std::uint32_t>(at));
  update();
  return done;
}

void U3vCamera::written(std::uint32_t at) {
  if (at == kLatch) store(kTimestamp, nanoseconds(now()), 8);
  if (at == kChunkEnable) store(kChunkEnables + 4 * (reg(kChunkSelector) & 1U), reg(kChunkEnable));
  if (at != kStreamOn) return;
  transfers_.clear();
  held_.reset();
  taken_ = 0;
  next_id_ = 0;
}

void U3vCamera::acknowledge(std::uint16_t status, unsigned command, unsigned id, const Bytes& payload) {
  Bytes bytes;
  put(bytes, kControlMagic, 4);
  put(bytes, status, 2);
  put(bytes, command + 1, 2);
  put(bytes, payload.size(), 2);
  put(bytes, id, 2);
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  answers_.push_back(std::move(bytes));
}

/// A command of the control channel. One that is cut short gets no answer.
bool U3vCamera::out(unsigned endpoint, std::span<const std::uint8_t> bytes) {
  constexpr unsigned kRead = 0x0800, kWrite = 0x0802;
  if (endpoint != 1 || bytes.size() < kHead || get(bytes, 0, 4) != kControlMagic) return true;
  const auto command = static_cast<unsigned>(get(bytes, 6, 2)), id = static_cast<unsigned>(get(bytes, 10, 2));
  const auto body = bytes.subspan(kHead);
  if (body.size() != get(bytes, 8, 2)) return true;
  Bytes payload;
  if (command == kRead && body.size() == 12) {
    const auto count = static_cast<std::size_t>(get(body, 10, 2));
    if (count > kLongestPacket - kHead) {
      acknowledge(invalid_parameter, command, id, {});
    } else {
      const auto data = read(get(body, 0, 8), count);
      acknowledge(data ? done : invalid_address, command, id, data.value_or(Bytes{}));
    }
  } else if (command == kWrite && body.size() > 8) {
    const std::uint16_t status = write(get(body, 0, 8), body.subspan(8));
    put(payload, 0, 2);
    put(payload, status == done ? body.size() - 8 : 0, 2);
    acknowledge(status, command, id, payload);
  } else {
    acknowledge(not_implemented, command, id, {});
  }
  return true;
}

/// A read of the stream gets bytes of one transfer only: the end of a transfer ends the read.
std::optional<Bytes> U3vCamera::in(unsigned endpoint, std::size_t most) {
  if (endpoint == 1 && !answers_.empty()) {
    Bytes bytes = std::move(answers_.front());
    answers_.pop_front();
    bytes.resize(std::min(bytes.size(), most));
    return bytes;
  }
  if (endpoint != 2 || transfers_.empty()) return std::nullopt;
  const Bytes& transfer = transfers_.front();
  const std::size_t count = std::min(most, transfer.size() - taken_);
  const auto begin = transfer.begin() + static_cast<std::ptrdiff_t>(taken_);
  Bytes bytes(begin, begin + static_cast<std::ptrdiff_t>(count));
  taken_ += count;
  if (taken_ == transfer.size()) {
    transfers_.pop_front();
    taken_ = 0;
  }
  return bytes;
}

std::size_t U3vCamera::image_bytes() const {
  const std::size_t bits = reg(0x10010) >> 16U & 0xFFU;
  return std::size_t{reg(0x10000)} * reg(0x10004) * bits / 8;
}

std::size_t U3vCamera::payload_bytes() const {
  return image_bytes() + (chunks() ? 8 + reg(kChunkEnables) * 12U + reg(kChunkEnables + 4) * 16U : 0);
}

/// The picture, and behind it the chunks, each with its id and length.
Bytes U3vCamera::payload(const Shot& shot) const {
  std::vector<std::uint16_t> codes(static_cast<std::size_t>(shot.rows) * static_cast<std::size_t>(shot.cols));
  scene_(shot, codes);
  Bytes data = gige::packed(codes, reg(0x10010));
  if (!chunks()) return data;
  put(data, 0xC000, 4);
  put(data, image_bytes(), 4);
  const auto chunk = [&data](std::uint64_t id, std::uint64_t value, int bytes) {
    put(data, value, bytes);
    put(data, id, 4);
    put(data, static_cast<std::uint64_t>(bytes), 4);
  };
  if (reg(kChunkEnables) != 0) chunk(0xC001, shot.counter, 4);
  if (reg(kChunkEnables + 4) != 0) chunk(0xC002, nanoseconds(shot.exposure), 8);
  return data;
}

void U3vCamera::send(const Exposed& exposed) {
  const auto& [shot, data] = exposed;
  const std::uint64_t id = next_id_++;
  const auto head = [id](std::uint32_t magic, std::size_t size) {
    Bytes bytes;
    put(bytes, magic, 4);
    put(bytes, 0, 2);
    put(bytes, size, 2);
    put(bytes, id, 8);
    return bytes;
  };
  Bytes leader = head(kLeaderMagic, kLeader);
  put(leader, 0, 2);
  put(leader, chunks() ? 0x4001 : 0x0001, 2);
  put(leader, nanoseconds(shot.stamp), 8);
  for (const std::uint32_t at : {0x10010U, 0x10000U, 0x10004U, 0x10008U, 0x1000CU}) put(leader, reg(at), 4);
  put(leader, 0, 4);
  transfers_.push_back(std::move(leader));
  // The host chose how the payload is cut.
  std::vector<std::size_t> sizes(reg(kPayloadCount), reg(kPayloadSize));
  sizes.insert(sizes.end(), {reg(kLastSizes), reg(kLastSizes + 4)});
  std::size_t sent = 0;
  for (const std::size_t size : sizes) {
    const std::size_t count = std::min(size, data.size() - sent);
    if (count == 0) continue;
    const auto begin = data.begin() + static_cast<std::ptrdiff_t>(sent);
    transfers_.emplace_back(begin, begin + static_cast<std::ptrdiff_t>(count));
    sent += count;
  }
  Bytes trailer = head(kTrailerMagic, kTrailer);
  put(trailer, 0, 4);
  put(trailer, sent, 8);
  put(trailer, static_cast<std::uint64_t>(shot.rows), 4);
  transfers_.push_back(std::move(trailer));
}

bool U3vCamera::pulse(std::chrono::nanoseconds width, gige::Mishap mishap,
                      std::optional<std::chrono::nanoseconds> ended) {
  using gige::Mishap;
  const bool armed = reg(kStart) != 0 && (reg(kStreamOn) & 1U) != 0 && reg(0x10020) == 1 && reg(0x10024) == 1;
  if (!armed || mishap == Mishap::trigger_dropped) return false;
  const bool timed = reg(0x1002C) == 0;
  const Shot shot{++counter_,
                  timed ? std::chrono::nanoseconds(reg(0x10030)) : width,
                  ended.value_or(now()),
                  static_cast<int>(reg(0x10004)),
                  static_cast<int>(reg(0x10000)),
                  static_cast<int>(reg(0x1000C)),
                  static_cast<int>(reg(0x10008))};
  const std::optional<Exposed> before = std::exchange(held_, std::nullopt);
  const bool swapped = std::exchange(swap_, false);
  if (before && !swapped) send(*before);
  if (mishap == Mishap::frame_dropped)
    ++next_id_;
  else if (mishap == Mishap::none)
    send({shot, payload(shot)});
  else
    held_ = Exposed{shot, payload(shot)};
  swap_ = mishap == Mishap::swapped;
  if (before && swapped) send(*before);
  return true;
}

}  // namespace symrig::u3v
