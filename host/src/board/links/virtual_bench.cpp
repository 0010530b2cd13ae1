// SPDX-License-Identifier: Apache-2.0

#include "symrig/board/virtual_bench.hpp"

#include "symrig/base/files.hpp"
#include "symrig/base/internal/byte_stream.hpp"
#include "symrig/board/internal/links.hpp"

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::board {

/// Writes little-endian numbers one after another: the payloads of the virtual link.
class Packer {
 public:
  template <class T>
  Packer& put(T value) {
    for (std::size_t k = 0; k < sizeof(T); ++k)
      bytes_.push_back(static_cast<std::uint8_t>(static_cast<std::uint64_t>(value) >> (8 * k)));
    return *this;
  }
  std::span<const std::uint8_t> bytes() const { return bytes_; }

 private:
  std::vector<std::uint8_t> bytes_;
};

/// The number that begins at `offset`. The caller has checked that the bytes suffice.
template <class T>
T unpack(std::span<const std::uint8_t> bytes, std::size_t offset) {
  std::uint64_t value = 0;
  for (std::size_t k = 0; k < sizeof(T); ++k) value |= std::uint64_t{bytes[offset + k]} << (8 * k);
  return static_cast<T>(value);
}

}  // namespace symrig::board

namespace symrig {

/// Requests and answers of the virtual link: u8 type, u32 length, payload. Each request has one answer, in
/// order.
class VirtualBench::Connection {
 public:
  explicit Connection(base::ByteStream stream) : stream_(std::move(stream)) {}

  /// The payload of the answer, which has at least `least` bytes. fails: device_lost (no answer, connection
  /// closed, or the server's own reason), protocol.
  /// board_time: how long the board runs for this request. After one missing answer all further calls fail.
  Result<std::vector<std::uint8_t>> ask(char type, std::span<const std::uint8_t> payload, std::size_t least,
                                        Nanoseconds board_time = Nanoseconds{0});
  /// A request whose answer has no payload.
  Result<void> tell(char type, std::span<const std::uint8_t> payload,
                    Nanoseconds board_time = Nanoseconds{0});

 private:
  Result<void> fill(std::size_t count, Nanoseconds patience);
  Error silence(Nanoseconds patience) const;

  base::ByteStream stream_;
  std::vector<std::uint8_t> waiting_;
  bool silent_ = false;
};

namespace {

using namespace std::chrono_literals;
constexpr Nanoseconds kHello = 5s;      // for the first answer: whether a board is there at all
constexpr Nanoseconds kPatience = 15s;  // for an answer that needs no time of the board
constexpr Nanoseconds kMost = 120s;
constexpr std::int64_t kSlowness = 300;  // real seconds for one second of an emulated board, at most
constexpr std::size_t kHeader = 5;
constexpr std::size_t kMaxPayload = std::size_t{1} << 26;

Nanoseconds patience_for(Nanoseconds board_time) {
  return std::min(kPatience + kSlowness * std::min(board_time, kMost), kMost);
}

}  // namespace

Error VirtualBench::Connection::silence(Nanoseconds patience) const {
  return {ErrorCode::device_lost,
          fmt::format("{}: no answer for {} s", stream_.name(), patience / Nanoseconds{1s}),
          "check the virtual board's server"};
}

/// Reads until `count` bytes are in the buffer.
Result<void> VirtualBench::Connection::fill(std::size_t count, Nanoseconds patience) {
  while (waiting_.size() < count) {
    SYMRIG_TRY(const auto bytes, stream_.receive(patience));
    silent_ = bytes.empty();
    if (silent_) return silence(patience);
    waiting_.insert(waiting_.end(), bytes.begin(), bytes.end());
  }
  return {};
}

Result<std::vector<std::uint8_t>> VirtualBench::Connection::ask(char type,
                                                                std::span<const std::uint8_t> payload,
                                                                std::size_t least, Nanoseconds board_time) {
  const Nanoseconds patience = type == 'h' ? kHello : patience_for(board_time);
  if (silent_) return silence(patience);
  board::Packer packer;
  packer.put(type).put(static_cast<std::uint32_t>(payload.size()));
  std::vector<std::uint8_t> message(packer.bytes().begin(), packer.bytes().end());
  message.insert(message.end(), payload.begin(), payload.end());
  SYMRIG_CHECK(stream_.send(message, patience));

  SYMRIG_CHECK(fill(kHeader, patience));
  const char kind = static_cast<char>(waiting_[0]);
  const std::size_t size = board::unpack<std::uint32_t>(waiting_, 1);
  if ((kind != type && kind != 'x') || size > kMaxPayload || (kind == type && size < least))
    return Error{ErrorCode::protocol,
                 fmt::format("{}: the answer to '{}' is not valid", stream_.name(), type),
                 "check that the server is a virtual board of this version"};
  SYMRIG_CHECK(fill(kHeader + size, patience));
  const auto begin = waiting_.begin() + kHeader;
  std::vector<std::uint8_t> answer(begin, begin + static_cast<std::ptrdiff_t>(size));
  waiting_.erase(waiting_.begin(), begin + static_cast<std::ptrdiff_t>(size));
  if (kind == type) return answer;
  return Error{ErrorCode::device_lost,
               fmt::format("{}: {}", stream_.name(), std::string(answer.begin(), answer.end())),
               "the virtual board cannot do that"};
}

Result<void> VirtualBench::Connection::tell(char type, std::span<const std::uint8_t> payload,
                                            Nanoseconds board_time) {
  SYMRIG_CHECK(ask(type, payload, 0, board_time));
  return {};
}

namespace {

using namespace std::chrono_literals;
constexpr std::uint32_t kVersion = 1;
constexpr std::uint8_t kLetGo = 2;
constexpr std::uint8_t kAll = 255;
constexpr std::size_t kEdgeBytes = 10;
constexpr Nanoseconds kRestart = 2s;  // of the board's time: it boots and connects again

Nanoseconds time_in(std::span<const std::uint8_t> answer) {
  return Nanoseconds{board::unpack<std::int64_t>(answer, 0)};
}

class VirtualLink final : public Link {
 public:
  VirtualLink(std::shared_ptr<VirtualBench::Connection> connection, Nanoseconds opened)
      : connection_(std::move(connection)), opened_(opened), now_(opened) {}

  Result<void> send(std::span<const std::uint8_t> bytes) override { return connection_->tell('w', bytes); }

  Result<std::vector<std::uint8_t>> receive(Nanoseconds timeout) override {
    // The board's clock has steps: a shorter wait might not advance it, and the caller would wait for ever.
    const Nanoseconds wait = timeout.count() > 0 ? std::max<Nanoseconds>(timeout, 1us) : Nanoseconds{0};
    SYMRIG_TRY(auto answer, connection_->ask('r', board::Packer().put(wait.count()).bytes(), 8, wait));
    now_ = time_in(answer);
    answer.erase(answer.begin(), answer.begin() + 8);
    return answer;
  }

  /// The board's time stands still between two receive(), so the time of the last one is still valid.
  Nanoseconds now() const override { return now_ - opened_; }

 private:
  std::shared_ptr<VirtualBench::Connection> connection_;
  Nanoseconds opened_, now_;
};

/// The board's present time, or 0 if the request fails: the first receive() then fails too.
Nanoseconds time_or_zero(const Result<Nanoseconds>& now) {
  return now ? *now : Nanoseconds{0};
}

Result<Fd> dial(const DeviceUri& uri) {
  if (uri.transport == Transport::virtual_unix) return board::connect_unix(uri.place);
  if (uri.transport == Transport::virtual_tcp) return board::connect_tcp(uri.place, uri.port, 5s);
  return Error{ErrorCode::bad_argument, fmt::format("{} is not a board in virtual time", uri.text()),
               "give virtual:unix:PATH or virtual:tcp:HOST:PORT"};
}

}  // namespace

Result<VirtualBench> VirtualBench::connect(const DeviceUri& uri) {
  SYMRIG_TRY(Fd fd, dial(uri));
  VirtualBench bench(std::make_shared<Connection>(base::ByteStream(std::move(fd), uri.text())));
  SYMRIG_TRY(const auto hello, bench.connection_->ask('h', {}, 12));
  const auto version = board::unpack<std::uint32_t>(hello, 0);
  if (version != kVersion)
    return Error{
        ErrorCode::protocol,
        fmt::format("{} uses version {} of the virtual link, this host {}", uri.text(), version, kVersion),
        "update the older one"};
  bench.tick_hz_ = board::unpack<std::uint64_t>(hello, 4);
  bench.name_.assign(hello.begin() + 12, hello.end());
  return bench;
}

std::unique_ptr<Link> VirtualBench::link() const {
  return std::make_unique<VirtualLink>(connection_, time_or_zero(now()));
}

Result<Nanoseconds> VirtualBench::now() const {
  SYMRIG_TRY(const auto answer, connection_->ask('n', {}, 8));
  return time_in(answer);
}

Result<void> VirtualBench::drive(std::uint8_t gpio, bool level) const {
  return connection_->tell('i', board::Packer().put(gpio).put(std::uint8_t{level}).bytes());
}

Result<void> VirtualBench::let_go(std::uint8_t gpio) const {
  return connection_->tell('i', board::Packer().put(gpio).put(kLetGo).bytes());
}

Result<void> VirtualBench::jumper(std::uint8_t from, std::uint8_t to) const {
  return connection_->tell('j', board::Packer().put(from).put(to).bytes());
}

Result<void> VirtualBench::remove_jumpers() const {
  return connection_->tell('j', board::Packer().put(kAll).put(kAll).bytes());
}

Result<void> VirtualBench::pulse(std::uint8_t gpio, Nanoseconds period, Nanoseconds width) const {
  return connection_->tell('v', board::Packer().put(gpio).put(period.count()).put(width.count()).bytes());
}

Result<std::vector<PinEdge>> VirtualBench::edges() const {
  SYMRIG_TRY(const auto answer, connection_->ask('e', {}, 0));
  std::vector<PinEdge> edges;
  for (std::size_t at = 0; at + kEdgeBytes <= answer.size(); at += kEdgeBytes)
    edges.push_back({board::unpack<std::uint64_t>(answer, at), answer[at + 8], answer[at + 9] != 0});
  return edges;
}

Result<void> VirtualBench::cable(bool in) const {
  return connection_->tell('d', board::Packer().put(std::uint8_t{in}).bytes(), kRestart);
}

Result<void> VirtualBench::stall(Nanoseconds time) const {
  return connection_->tell('s', board::Packer().put(static_cast<std::uint64_t>(time.count())).bytes(), time);
}

Result<void> VirtualBench::power_cycle() const {
  return connection_->tell('p', {}, kRestart);
}

}  // namespace symrig
