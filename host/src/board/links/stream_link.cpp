// SPDX-License-Identifier: Apache-2.0
#include "board/links/links.hpp"
#include "symrig/base/files.hpp"
#include "symrig/base/internal/byte_stream.hpp"
#include "symrig/base/time.hpp"

#include <utility>

namespace symrig::board {
namespace {

using namespace std::chrono_literals;
constexpr Nanoseconds kSendPatience = 2s;  // a board accepts its bytes within milliseconds

class StreamLink final : public Link {
 public:
  StreamLink(base::ByteStream stream, Nanoseconds restart_time)
      : stream_(std::move(stream)), opened_(steady_now()), restart_time_(restart_time) {}

  Result<void> send(std::span<const std::uint8_t> bytes) override {
    return stream_.send(bytes, kSendPatience);
  }
  Result<std::vector<std::uint8_t>> receive(Nanoseconds timeout) override { return stream_.receive(timeout); }
  Nanoseconds now() const override { return steady_now() - opened_; }
  SteadyTime opened() const override { return {opened_}; }
  Nanoseconds restart_time() const override { return restart_time_; }

 private:
  base::ByteStream stream_;
  Nanoseconds opened_, restart_time_;
};

}  // namespace

std::unique_ptr<Link> make_stream_link(Fd fd, std::string name, Nanoseconds restart_time) {
  return std::make_unique<StreamLink>(base::ByteStream(std::move(fd), std::move(name)), restart_time);
}

}  // namespace symrig::board
