// SPDX-License-Identifier: Apache-2.0
#include "symrig/board/virtual_bench.hpp"

#include "board/links/links.hpp"
#include "board/links/virtual_connection.hpp"
#include "symrig/base/files.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace symrig {
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
