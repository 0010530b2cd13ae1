// SPDX-License-Identifier: Apache-2.0
#include "transport.hpp"

#include "symrig/protocol/busy_answer.hpp"

#include <algorithm>

namespace symrig::board_linux {

std::size_t BufferedTransport::read(std::uint8_t* out, std::size_t room) {
  const std::size_t count = std::min(room, in_.size());
  std::copy_n(in_.begin(), count, out);
  in_.erase(in_.begin(), in_.begin() + static_cast<std::ptrdiff_t>(count));
  if (count > 0) drained();
  return count;
}

std::size_t BufferedTransport::room() const {
  return attached() ? kRoom - std::min(kRoom, out_.size()) : 0;
}

void BufferedTransport::write(const std::uint8_t* bytes, std::size_t size) {
  out_.insert(out_.end(), bytes, bytes + size);
  flush();
}

void BufferedTransport::turn_away() {
  protocol::BusyAnswer busy;
  const protocol::ByteView answer = busy.take({in_.data(), in_.size()});
  in_.clear();
  drained();
  write(answer.data, answer.size);
}

}  // namespace symrig::board_linux
