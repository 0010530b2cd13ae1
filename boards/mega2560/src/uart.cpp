// SPDX-License-Identifier: Apache-2.0
#include "uart.hpp"

#include "interrupts.hpp"

namespace symrig::mega2560 {
namespace {

/// The place after `index` in a ring of `size`.
uint8_t next(uint8_t index, uint8_t size) {
  return index + 1 == size ? 0 : static_cast<uint8_t>(index + 1);
}

}  // namespace

void Uart::begin() {
  UCSR0A = 1U << U2X0;  // before UBRR0: simavr 1.6 reads it only when UBRR0 is written
  UBRR0 = 16;           // 117,647 baud at 16 MHz: 2.1 % fast, like the USB chip's own divider
  UCSR0C = (1U << UCSZ01) | (1U << UCSZ00);
  UCSR0B = (1U << RXCIE0) | (1U << RXEN0) | (1U << TXEN0);
}

size_t Uart::read(uint8_t* out, size_t room) {
  size_t count = 0;
  while (count < room && in_taken_ != in_put_) {
    out[count++] = in_[in_taken_];
    in_taken_ = next(in_taken_, kIn);
  }
  return count;
}

size_t Uart::room() const {
  const uint8_t taken = out_taken_;
  const uint8_t put = out_put_;
  const auto used = static_cast<uint8_t>(put >= taken ? put - taken : put + kOut - taken);
  return static_cast<size_t>(kOut - 1 - used);
}

void Uart::write(const uint8_t* bytes, size_t size) {
  for (size_t i = 0; i < size; ++i) {
    out_[out_put_] = bytes[i];
    out_put_ = next(out_put_, kOut);
  }
  const IrqLock lock;
  UCSR0B |= 1U << UDRIE0;
}

void Uart::received(uint8_t byte) {
  if (scan_.push(byte)) engine_.stop_now();
  const uint8_t after = next(in_put_, kIn);
  if (after == in_taken_) return;
  in_[in_put_] = byte;
  in_put_ = after;
}

void Uart::may_send() {
  if (out_taken_ == out_put_) {
    UCSR0B &= static_cast<uint8_t>(~(1U << UDRIE0));
    return;
  }
  UDR0 = out_[out_taken_];
  out_taken_ = next(out_taken_, kOut);
}

}  // namespace symrig::mega2560
