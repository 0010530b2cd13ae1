// SPDX-License-Identifier: Apache-2.0
#include "peripherals.hpp"
#include "symrig/protocol/crc32c.hpp"

#include <avr/eeprom.h>

namespace symrig::mega2560 {
namespace {

constexpr uint16_t kPlace = 2048;  // bytes of a place; the EEPROM has 4,096

/// The head of a place. An erased EEPROM reads ones.
struct Head {
  uint16_t number;  // counts saves; the larger one is the present record
  uint16_t size;
  uint32_t crc;  // of number, size and the record
};

uint8_t* address(uint16_t at) {
  return reinterpret_cast<uint8_t*>(at);  // NOLINT(performance-no-int-to-ptr): avr-libc's EEPROM pointers
}

void write(uint16_t at, const void* from, uint16_t size) {
  const auto* bytes = static_cast<const uint8_t*>(from);
  for (uint16_t i = 0; i < size; ++i) {
    eeprom_update_byte(address(static_cast<uint16_t>(at + i)), bytes[i]);
    feed_watchdog();
  }
}

uint32_t crc_of(const Head& head, uint16_t place) {
  protocol::Crc32c crc;
  crc.add({reinterpret_cast<const uint8_t*>(&head), 4});
  for (uint16_t i = 0; i < head.size; ++i)
    crc.add(eeprom_read_byte(address(static_cast<uint16_t>(place + sizeof head + i))));
  return crc.value();
}

bool read_head(uint16_t place, Head& head) {
  eeprom_read_block(&head, address(place), sizeof head);
  return head.size <= hal::Settings::kRoom && crc_of(head, place) == head.crc;
}

/// The place of the present record, or none.
bool find(uint16_t& place, Head& head) {
  Head other{};
  const bool first = read_head(0, head);
  const bool second = read_head(kPlace, other);
  const bool newer = second && (!first || static_cast<int16_t>(other.number - head.number) > 0);
  if (newer) head = other;
  place = newer ? kPlace : 0;
  return first || second;
}

}  // namespace

size_t MegaSettings::load(uint8_t* out, size_t room) const {
  uint16_t place = 0;
  Head head{};
  if (!find(place, head) || head.size > room) return 0;
  eeprom_read_block(out, address(static_cast<uint16_t>(place + sizeof head)), head.size);
  return head.size;
}

bool MegaSettings::save(const uint8_t* bytes, size_t size) {
  if (size > kRoom) return false;
  uint16_t place = 0;
  Head head{};
  const bool any = find(place, head);
  const uint16_t target = any && place == 0 ? kPlace : 0;
  head = {static_cast<uint16_t>(any ? head.number + 1 : 1), static_cast<uint16_t>(size), 0};
  write(static_cast<uint16_t>(target + sizeof head), bytes, head.size);
  head.crc = crc_of(head, target);
  write(target, &head, sizeof head);
  Head kept{};
  return find(place, kept) && place == target && kept.crc == head.crc;
}

}  // namespace symrig::mega2560
