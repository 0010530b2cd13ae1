// SPDX-License-Identifier: Apache-2.0
#include "link_switch.hpp"

namespace symrig::board_linux {

std::size_t LinkSwitch::read(std::uint8_t* out, std::size_t room) {
  return holder_ != nullptr ? holder_->read(out, room) : 0;
}

void LinkSwitch::write(const std::uint8_t* bytes, std::size_t size) {
  if (holder_ != nullptr) holder_->write(bytes, size);
}

void LinkSwitch::watch(std::vector<pollfd>& fds) const {
  for (const auto& transport : transports_) transport->watch(fds);
}

Transport* LinkSwitch::first_speaker() const {
  for (const auto& transport : transports_)
    if (transport.get() != holder_ && transport->attached() && transport->pending()) return transport.get();
  return nullptr;
}

bool LinkSwitch::serve(hal::Tick now) {
  for (const auto& transport : transports_) transport->serve();
  if (pending()) heard_ = now;
  Transport* speaker = first_speaker();
  const bool gone = holder_ != nullptr && !holder_->attached();
  const bool gives_way = holder_ != nullptr && speaker != nullptr && now - heard_ >= kSilence;
  if (gone || gives_way) {
    holder_ = nullptr;
    return true;
  }
  if (holder_ == nullptr && speaker != nullptr) {
    holder_ = speaker;
    heard_ = now;
    return true;
  }
  while (holder_ != nullptr && speaker != nullptr) {
    speaker->turn_away();
    speaker = first_speaker();
  }
  return false;
}

}  // namespace symrig::board_linux
