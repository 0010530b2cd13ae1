// SPDX-License-Identifier: Apache-2.0

#include "gige/gige_camera.hpp"

#include <algorithm>
#include <array>
#include <cstring>
#include <stdexcept>
#include <utility>

#include <arpa/inet.h>
#include <fmt/format.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

namespace symrig::gige {

Bytes packed(std::span<const std::uint16_t> codes, std::uint32_t format) {
  Bytes bytes;
  bytes.reserve(2 * codes.size());
  const auto low_first = [&bytes](unsigned value) {
    bytes.push_back(static_cast<std::uint8_t>(value));
    bytes.push_back(static_cast<std::uint8_t>(value >> 8U));
  };
  for (std::size_t k = 0; k < codes.size(); ++k) {
    const unsigned code = codes[k];
    if (format == 0x01080001) bytes.push_back(static_cast<std::uint8_t>(code >> 8U));
    if (format == 0x01100003) low_first(code >> 6U);
    if (format == 0x01100005 || format == 0x01100011) low_first(code >> 4U);
    if (format == 0x01100007) low_first(code);
    if ((format == 0x010C0047 || format == 0x010C0006) && k % 2 == 1) {
      const unsigned a = codes[k - 1] >> 4U, b = code >> 4U;
      const bool plain = format == 0x010C0047;
      bytes.push_back(static_cast<std::uint8_t>(plain ? a : a >> 4U));
      bytes.push_back(static_cast<std::uint8_t>(plain ? a >> 8U | b << 4U : (a & 15U) | b << 4U));
      bytes.push_back(static_cast<std::uint8_t>(b >> 4U));
    }
  }
  return bytes;
}

namespace {

using namespace std::chrono_literals;

constexpr std::uint16_t kControlPort = 3956;
constexpr std::uint32_t kXmlAt = 0x20000;
constexpr std::uint32_t kPrivilege = 0xA00, kStreamPort = 0xD00, kPacketSize = 0xD04, kStreamTo = 0xD18,
                        kHeartbeat = 0x938, kLatch = 0x944;
constexpr std::uint32_t kStart = 0x10018, kPayload = 0x10050, kChunkSelector = 0x10044,
                        kChunkEnable = 0x10048, kChunkEnables = 0x10070, kBinning = 0x10078,
                        kWidthMost = 0x10080, kHeightMost = 0x10084;
constexpr std::size_t kBlocksKept = 16;
constexpr std::size_t kPacketOverhead = 36;  // of IP, UDP and GVSP

void put(Bytes& to, std::uint64_t value, int bytes) {
  for (int k = bytes - 1; k >= 0; --k) to.push_back(static_cast<std::uint8_t>(value >> 8 * k));
}

std::uint32_t get(std::span<const std::uint8_t> from, std::size_t at, int bytes) {
  std::uint32_t value = 0;
  for (int k = 0; k < bytes; ++k) value = value << 8U | from[at + static_cast<std::size_t>(k)];
  return value;
}

std::uint64_t nanoseconds_now() {
  return static_cast<std::uint64_t>(
      std::chrono::nanoseconds(std::chrono::steady_clock::now().time_since_epoch()).count());
}

/// 127.a.b.c of this process; c counts its cameras.
std::string next_address() {
  static std::atomic<unsigned> count = 0;
  const auto pid = static_cast<unsigned>(getpid());
  return fmt::format("127.{}.{}.{}", 16 + (pid >> 8U) % 200, pid & 255U, 1 + count++ % 250);
}

int bound_socket(const std::string& address, std::uint16_t port, bool shared = false) {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  const int on = 1;
  if (shared) setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  sockaddr_in at{};
  at.sin_family = AF_INET;
  at.sin_port = htons(port);
  inet_pton(AF_INET, address.c_str(), &at.sin_addr);
  if (fd < 0 || bind(fd, reinterpret_cast<const sockaddr*>(&at), sizeof at) != 0)
    throw std::runtime_error(fmt::format("no socket at {}:{}: {}", address, port, std::strerror(errno)));
  return fd;
}

}  // namespace

GigeCamera::GigeCamera(CameraTraits traits, Scene scene)
    : traits_(std::move(traits)),
      scene_(std::move(scene)),
      address_(traits_.address.empty() ? next_address() : traits_.address),
      xml_(camera_xml(traits_)),
      loss_(traits_.packet_loss) {
  memory_.resize(kXmlAt);
  control_ = bound_socket(address_, kControlPort);
  stream_ = bound_socket(address_, 0);
  if (traits_.discoverable) broadcast_ = bound_socket("255.255.255.255", kControlPort, true);
  set_defaults();
  thread_ = std::thread([this] { serve(); });
}

GigeCamera::~GigeCamera() {
  stopping_ = true;
  thread_.join();
  close(control_);
  close(stream_);
  if (broadcast_ >= 0) close(broadcast_);
}

void GigeCamera::set_defaults() {
  std::ranges::fill(memory_, std::uint8_t{0});
  const auto name = [this](std::size_t at, const std::string& text) {
    std::ranges::copy(text, memory_.begin() + static_cast<std::ptrdiff_t>(at));
  };
  store(0, 0x00010002);    // GigE Vision 1.2
  store(4, 0x80000001);    // big-endian, UTF-8
  store(0xC, 0x00010203);  // MAC
  in_addr at{};
  inet_pton(AF_INET, address_.c_str(), &at);
  store(0x24, ntohl(at.s_addr));
  name(0x48, "Symrig");
  name(0x68, "Loopback");
  name(0x88, "1.0");
  name(0xD8, fmt::format("S{}", address_.substr(4)));
  name(0x200, fmt::format("Local:loopback.xml;{:x};{:x}", kXmlAt, xml_.size()));
  store(0x600, 1);
  store(0x904, 1);
  store(0x934, 2U | (traits_.resends ? 4U : 0U) | 32U);  // write memory, resend, pending
  store(kHeartbeat, 3000);
  store(0x940, 1'000'000'000);  // ticks a second
  store(kPacketSize, 1500);
  store(0x10000, static_cast<std::uint32_t>(traits_.cols));
  store(0x10004, static_cast<std::uint32_t>(traits_.rows));
  store(0x10010, 0x01080001);
  store(0x10030, 10'000'000);
  store(0x10058, static_cast<std::uint32_t>(std::chrono::nanoseconds(traits_.readout).count()));
  store(0x10034, 7'000);                        // a delay that another program left
  store(0x10088, traits_.can_overlap ? 1 : 0);  // and its overlap
  if (traits_.longest_overlap)
    store(0x1008C, static_cast<std::uint32_t>(std::chrono::nanoseconds(*traits_.longest_overlap).count()));
  store(kBinning, 1);
  store(kBinning + 4, 1);
  controller_.reset();
  sent_.clear();
  held_.reset();
  counter_ = 0;
  next_id_ = traits_.first_id;
}

void GigeCamera::reboot() {
  const std::lock_guard lock(mutex_);
  set_defaults();
}

std::uint32_t GigeCamera::reg(std::uint32_t at) const {
  const std::lock_guard lock(mutex_);
  return read(at);
}

void GigeCamera::store(std::uint32_t at, std::uint32_t value) {
  for (unsigned k = 0; k < 4; ++k) memory_[at + k] = static_cast<std::uint8_t>(value >> (24 - 8 * k));
}

std::uint32_t GigeCamera::read(std::uint32_t at) const {
  if (at == kWidthMost) return static_cast<std::uint32_t>(traits_.cols) / std::max(1U, read(kBinning));
  if (at == kHeightMost) return static_cast<std::uint32_t>(traits_.rows) / std::max(1U, read(kBinning + 4));
  if (at == kPayload) return static_cast<std::uint32_t>(payload_bytes());
  if (at == kChunkEnable) return read(kChunkEnables + 4 * (read(kChunkSelector) & 1U));
  return at + 4 <= memory_.size() ? get(memory_, at, 4) : 0;
}

bool GigeCamera::write(std::uint32_t at, std::uint32_t value, const sockaddr_in& from) {
  const bool mine = controller_ && controller_->sin_port == from.sin_port &&
                    controller_->sin_addr.s_addr == from.sin_addr.s_addr;
  if ((controller_ && !mine) || (!controller_ && at != kPrivilege) || at + 4 > memory_.size()) return false;
  if (at == kPrivilege) {
    controller_ = value == 0 ? std::nullopt : std::optional(from);
    if (value == 0) store(kStart, 0);
  }
  if (at == kLatch && (value & 2U) != 0) {
    const std::uint64_t now = nanoseconds_now();
    store(0x948, static_cast<std::uint32_t>(now >> 32U));
    store(0x94C, static_cast<std::uint32_t>(now));
    return true;
  }
  store(at == kChunkEnable ? kChunkEnables + 4 * (read(kChunkSelector) & 1U) : at, value);
  return true;
}

void GigeCamera::serve() {
  while (!stopping_) {
    std::array<pollfd, 2> ready{{{control_, POLLIN, 0}, {broadcast_, POLLIN, 0}}};
    poll(ready.data(), ready.size(), 20);  // a socket of -1 is left out
    const std::lock_guard lock(mutex_);
    // A controller that is silent for longer than the heartbeat has lost its control.
    if (controller_ &&
        std::chrono::steady_clock::now() - heard_ > std::chrono::milliseconds(read(kHeartbeat))) {
      controller_.reset();
      store(kPrivilege, 0);
      store(kStart, 0);
    }
    for (const pollfd& one : ready)
      if (one.revents != 0) receive(one.fd);
  }
}

void GigeCamera::receive(int socket) {
  Bytes request(2048);
  sockaddr_in from{};
  socklen_t length = sizeof from;
  const auto size =
      recvfrom(socket, request.data(), request.size(), 0, reinterpret_cast<sockaddr*>(&from), &length);
  if (size >= 8 && request[0] == 0x42) answer({request.data(), static_cast<std::size_t>(size)}, from);
}

void GigeCamera::reply(std::uint16_t status, std::uint16_t command, std::uint16_t id, const Bytes& payload,
                       const sockaddr_in& to) const {
  Bytes bytes;
  put(bytes, status, 2);
  put(bytes, command, 2);
  put(bytes, payload.size(), 2);
  put(bytes, id, 2);
  bytes.insert(bytes.end(), payload.begin(), payload.end());
  sendto(control_, bytes.data(), bytes.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
}

Bytes GigeCamera::discovery() const {
  return {memory_.begin(), memory_.begin() + 0xF8};
}

void GigeCamera::answer(std::span<const std::uint8_t> request, const sockaddr_in& from) {
  const auto command = static_cast<std::uint16_t>(get(request, 2, 2));
  const auto id = static_cast<std::uint16_t>(get(request, 6, 2));
  const auto body = request.subspan(8);
  const auto done = static_cast<std::uint16_t>(command + 1);
  heard_ = std::chrono::steady_clock::now();
  Bytes payload;
  if ((command == 0x0082 || command == 0x0086) && traits_.pending > 0ms) {
    put(payload, 0, 2);
    put(payload, static_cast<std::uint64_t>(10 * traits_.pending.count()), 2);
    reply(0, 0x0089, id, payload, from);
    std::this_thread::sleep_for(traits_.pending);
    payload.clear();
  }
  if (command == 0x0002) return reply(0, done, id, discovery(), from);
  if (command == 0x0040 && body.size() >= 12)
    return resend(static_cast<std::uint16_t>(get(body, 2, 2)), get(body, 4, 4) & 0xFFFFFFU,
                  get(body, 8, 4) & 0xFFFFFFU);
  if (command == 0x0080) {
    for (std::size_t k = 0; k + 4 <= body.size(); k += 4) put(payload, read(get(body, k, 4)), 4);
    return reply(0, done, id, payload, from);
  }
  if (command == 0x0082 && body.size() >= 8) {
    const bool taken = write(get(body, 0, 4), get(body, 4, 4), from);
    put(payload, taken ? 1 : 0, 4);
    return reply(taken ? 0 : 0x8006, done, id, payload, from);
  }
  if (command == 0x0084 && body.size() >= 8) {
    const std::uint32_t at = get(body, 0, 4), count = get(body, 6, 2);
    put(payload, at, 4);
    for (std::uint32_t k = 0; k < count; ++k)
      put(payload,
          at + k < kXmlAt                 ? memory_[at + k]
          : at + k - kXmlAt < xml_.size() ? static_cast<std::uint8_t>(xml_[at + k - kXmlAt])
                                          : 0U,
          1);
    // Registers that are computed are read in whole words.
    if (at < kXmlAt && count == 4) {
      payload.resize(4);
      put(payload, read(at), 4);
    }
    return reply(0, done, id, payload, from);
  }
  if (command == 0x0086 && body.size() >= 8) {
    bool taken = true;
    for (std::size_t k = 4; k + 4 <= body.size(); k += 4)
      taken = taken && write(get(body, 0, 4) + static_cast<std::uint32_t>(k - 4), get(body, k, 4), from);
    put(payload, body.size() - 4, 4);
    return reply(taken ? 0 : 0x8006, done, id, payload, from);
  }
  reply(0x8001, done, id, {}, from);
}

std::size_t GigeCamera::image_bytes() const {
  const std::size_t bits = read(0x10010) >> 16U & 0xFFU;
  return std::size_t{read(0x10000)} * read(0x10004) * bits / 8;
}

std::size_t GigeCamera::payload_bytes() const {
  return image_bytes() + (chunks() ? 8 + read(kChunkEnables) * 12U + read(kChunkEnables + 4) * 16U : 0);
}

Bytes GigeCamera::picture(const Shot& shot) const {
  std::vector<std::uint16_t> codes(static_cast<std::size_t>(shot.rows) * static_cast<std::size_t>(shot.cols));
  scene_(shot, codes);
  return packed(codes, read(0x10010));
}

void GigeCamera::transmit(const Bytes& packet) {
  if (std::uniform_real_distribution<>(0, 1)(random_) < loss_) {
    ++lost_;
    return;
  }
  sockaddr_in to{};
  to.sin_family = AF_INET;
  to.sin_port = htons(static_cast<std::uint16_t>(read(kStreamPort)));
  to.sin_addr.s_addr = htonl(read(kStreamTo));
  sendto(stream_, packet.data(), packet.size(), 0, reinterpret_cast<const sockaddr*>(&to), sizeof to);
  if (traits_.packet_gap > 0us) std::this_thread::sleep_for(traits_.packet_gap);
}

void GigeCamera::resend(std::uint16_t id, std::uint32_t first, std::uint32_t last) {
  if (!traits_.resends) return;
  for (const Block& block : sent_) {
    if (block.id != id) continue;
    for (std::size_t k = first; k <= last && k < block.packets.size(); ++k) {
      ++resent_;
      transmit(block.packets[k]);
    }
  }
}

/// 65535 is followed by 1.
std::uint16_t GigeCamera::take_id() {
  return std::exchange(next_id_,
                       next_id_ == 65'535 ? std::uint16_t{1} : static_cast<std::uint16_t>(next_id_ + 1));
}

void GigeCamera::send(Exposed exposed) {
  const Shot& shot = exposed.shot;
  Bytes data = std::move(exposed.picture);
  const bool with_chunks = chunks();
  const std::uint16_t kind = with_chunks ? 0x4001 : 0x0001;
  if (with_chunks) {
    put(data, 0xC000, 4);  // the picture is a chunk too
    put(data, image_bytes(), 4);
    const auto chunk = [&data](std::uint64_t id, std::uint64_t value, int bytes) {
      put(data, value, bytes);
      put(data, id, 4);
      put(data, static_cast<std::uint64_t>(bytes), 4);
    };
    if (read(kChunkEnables) != 0) chunk(0xC001, shot.counter, 4);
    if (read(kChunkEnables + 4) != 0) chunk(0xC002, static_cast<std::uint64_t>(shot.exposure.count()), 8);
  }
  Block block{traits_.ids_when_sent ? take_id() : exposed.id, {}};
  const auto packet = [&block](unsigned type) -> Bytes& {
    Bytes bytes;
    put(bytes, 0, 2);
    put(bytes, block.id, 2);
    put(bytes, type << 24U | block.packets.size(), 4);
    return block.packets.emplace_back(std::move(bytes));
  };
  Bytes& leader = packet(1);
  put(leader, 0, 2);
  put(leader, kind, 2);
  put(leader, static_cast<std::uint64_t>(shot.stamp.count()), 8);
  for (const std::uint32_t at : {0x10010U, 0x10000U, 0x10004U, 0x10008U, 0x1000CU}) put(leader, read(at), 4);
  put(leader, 0, 4);
  const std::size_t most = (read(kPacketSize) & 0xFFFFU) - kPacketOverhead;
  for (std::size_t at = 0; at < data.size(); at += most) {
    Bytes& part = packet(3);
    const auto begin = data.begin() + static_cast<std::ptrdiff_t>(at);
    part.insert(part.end(), begin, begin + static_cast<std::ptrdiff_t>(std::min(most, data.size() - at)));
  }
  Bytes& trailer = packet(2);
  put(trailer, 0, 2);
  put(trailer, kind, 2);
  put(trailer, static_cast<std::uint64_t>(shot.rows), 4);
  for (const Bytes& bytes : block.packets) transmit(bytes);
  sent_.push_back(std::move(block));
  if (sent_.size() > kBlocksKept) sent_.pop_front();
}

bool GigeCamera::pulse(std::chrono::nanoseconds width, Mishap mishap,
                       std::optional<std::chrono::nanoseconds> ended) {
  const std::lock_guard lock(mutex_);
  const bool armed = read(kStart) != 0 && read(0x10020) == 1 && read(0x10024) == 1;
  if (!armed || mishap == Mishap::trigger_dropped) return false;
  const bool timed = read(0x1002C) == 0;
  const Shot shot{++counter_,
                  timed ? std::chrono::nanoseconds(read(0x10030)) : width,
                  ended.value_or(std::chrono::nanoseconds(nanoseconds_now())),
                  static_cast<int>(read(0x10004)),
                  static_cast<int>(read(0x10000)),
                  static_cast<int>(read(0x1000C)),
                  static_cast<int>(read(0x10008))};
  const std::optional<Exposed> before = std::exchange(held_, std::nullopt);
  const bool swapped = std::exchange(swap_, false);
  if (before && !swapped) send(*before);
  if (mishap != Mishap::frame_dropped) {
    Exposed now{shot, picture(shot), traits_.ids_when_sent ? std::uint16_t{0} : take_id()};
    if (mishap == Mishap::none)
      send(std::move(now));
    else
      held_ = std::move(now);
    swap_ = mishap == Mishap::swapped;
  }
  if (before && swapped) send(*before);
  return true;
}

}  // namespace symrig::gige
