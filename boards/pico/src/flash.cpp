// SPDX-License-Identifier: Apache-2.0
#include "board_pins.hpp"
#include "chip.hpp"
#include "peripherals.hpp"
#include "registers.hpp"
#include "symrig/protocol/crc32c.hpp"

namespace symrig::pico {
namespace {

constexpr uint32_t kFlash = 0x10000000;
constexpr uint32_t kSector = 4096;
constexpr uint32_t kPage = 256;
constexpr uint32_t kMagic = 0x53796d53;
constexpr uint32_t kHeader = 16;
static_assert(kHeader + hal::Settings::kRoom <= kSector && kSettingsSectors == 2);

/// At the start of a sector: magic, sequence, size, and the CRC of sequence, size and bytes.
struct Header {
  uint32_t magic;
  uint32_t sequence;
  uint32_t size;
  uint32_t crc;
};

constexpr uint32_t offset_of(uint32_t slot) {
  return kFlashBytes - (2 - slot) * kSector;
}
const uint8_t* memory(uint32_t slot) {
  return reinterpret_cast<const uint8_t*>(kFlash + offset_of(slot));  // NOLINT(performance-no-int-to-ptr)
}

uint32_t crc_of(uint32_t sequence, const uint8_t* bytes, uint32_t size) {
  protocol::Crc32c crc;
  uint8_t numbers[8];
  protocol::put_u32(numbers, sequence);
  protocol::put_u32(numbers + 4, size);
  crc.add(protocol::ByteView{numbers, sizeof numbers});
  crc.add(protocol::ByteView{bytes, size});
  return crc.value();
}

bool sound(uint32_t slot, Header& header) {
  const uint8_t* from = memory(slot);
  header = {protocol::get_u32(from), protocol::get_u32(from + 4), protocol::get_u32(from + 8),
            protocol::get_u32(from + 12)};
  return header.magic == kMagic && header.size <= hal::Settings::kRoom &&
         header.crc == crc_of(header.sequence, from + kHeader, header.size);
}

/// The slot with the valid, newest record; -1: none.
int newest(Header& header) {
  Header headers[2];
  const bool is_sound[2] = {sound(0, headers[0]), sound(1, headers[1])};
  if (!is_sound[0] && !is_sound[1]) return -1;
  int slot = is_sound[0] ? 0 : 1;
  if (is_sound[0] && is_sound[1] && static_cast<int32_t>(headers[1].sequence - headers[0].sequence) > 0)
    slot = 1;
  header = headers[slot];
  return slot;
}

using Plain = void (*)();
using Erase = void (*)(uint32_t offset, uint32_t count, uint32_t block, uint8_t command);
using Program = void (*)(uint32_t offset, const uint8_t* bytes, uint32_t count);

/// The ROM functions that are needed while flash is off.
struct FlashRom {
  Plain connect = nullptr;
  Plain leave_xip = nullptr;
  Plain flush = nullptr;
  Erase erase = nullptr;
  Program program = nullptr;
};

template <typename F>
bool find(char first, char second, F& function) {
  function = reinterpret_cast<F>(rom_function(first, second));  // NOLINT(performance-no-int-to-ptr)
  return function != nullptr;
}

bool find_rom(FlashRom& rom) {
  return find('I', 'F', rom.connect) && find('E', 'X', rom.leave_xip) && find('F', 'C', rom.flush) &&
         find('R', 'E', rom.erase) && find('R', 'P', rom.program);
}

uint32_t boot2_copy[64];

/// boot2 sets up the flash for reading again. It runs from a copy, because flash is unavailable until then.
void copy_boot2() {
  for (uint32_t i = 0; i < 64; ++i) boot2_copy[i] = reg(kFlash + 4 * i);
}
SYMRIG_RAM void enter_xip() {
  reinterpret_cast<Plain>(address_of(boot2_copy) | 1U)();  // NOLINT(performance-no-int-to-ptr)
}

uint8_t page[kPage];

/// Writes `header`, then `size` bytes. Nothing may use flash in this function: interrupts are off, and all
/// code is in RAM or in the ROM.
SYMRIG_RAM __attribute__((noinline)) void replace_sector(const FlashRom& rom, uint32_t offset,
                                                         const uint8_t (&header)[kHeader],
                                                         const uint8_t* bytes, uint32_t size) {
  constexpr uint32_t kBlock = 65536;
  constexpr uint8_t kEraseBlock = 0xd8;
  rom.connect();
  rom.leave_xip();
  rom.erase(offset, kSector, kBlock, kEraseBlock);
  for (uint32_t at = 0; at < kHeader + size; at += kPage) {
    for (uint32_t i = at; i < at + kPage; ++i) {
      volatile uint8_t* to = page + (i - at);  // no call of memset, which is in flash
      *to = i < kHeader ? header[i] : i < kHeader + size ? bytes[i - kHeader] : 0xff;
    }
    rom.program(offset + at, page, kPage);
  }
  rom.flush();
  enter_xip();
}

namespace ssi {
constexpr uint32_t base = 0x18000000;
constexpr uint32_t status = base + 0x28, data = base + 0x60;
constexpr uint32_t can_send = 2, has_received = 8;
constexpr uint32_t chip_select = 0x4001800c;  // IO_QSPI: control of the chip select pin
constexpr uint32_t select = 2U << 8U, deselect = 3U << 8U, override_mask = 3U << 8U;
}  // namespace ssi

SYMRIG_RAM void drive_select(uint32_t how) {
  reg(ssi::chip_select) = (reg(ssi::chip_select) & ~ssi::override_mask) | how;
}

/// Command 4Bh, four dummy bytes, eight bytes of id; through the serial interface as the ROM leaves it.
SYMRIG_RAM __attribute__((noinline)) void ask_unique_id(const FlashRom& rom, uint8_t* id) {
  constexpr uint32_t kBytes = 13;
  rom.connect();
  rom.leave_xip();
  drive_select(ssi::select);
  uint32_t sent = 0;
  for (uint32_t received = 0; received < kBytes;) {
    if (sent < kBytes && sent - received < 14 && (reg(ssi::status) & ssi::can_send) != 0)
      reg(ssi::data) = sent++ == 0 ? 0x4bU : 0U;
    if ((reg(ssi::status) & ssi::has_received) == 0) continue;
    const auto byte = static_cast<uint8_t>(reg(ssi::data));
    if (received >= 5) id[received - 5] = byte;
    ++received;
  }
  drive_select(ssi::deselect);
  rom.flush();
  enter_xip();
}

}  // namespace

void read_unique_id(uint8_t (&id)[8]) {
  for (uint8_t& byte : id) byte = 0;
  FlashRom rom;
  if (!find_rom(rom)) return;
  copy_boot2();
  const IrqLock lock;
  ask_unique_id(rom, id);
}

size_t PicoSettings::load(uint8_t* out, size_t room) const {
  Header header{};
  const int slot = newest(header);
  if (slot < 0 || header.size > room) return 0;
  const uint8_t* from = memory(static_cast<uint32_t>(slot)) + kHeader;
  for (uint32_t i = 0; i < header.size; ++i) out[i] = from[i];
  return header.size;
}

bool PicoSettings::save(const uint8_t* bytes, size_t size) {
  FlashRom rom;
  if (size > kRoom || !find_rom(rom)) return false;
  Header header{};
  const int old = newest(header);
  const uint32_t slot = old == 0 ? 1 : 0;
  const uint32_t sequence = old < 0 ? 1 : header.sequence + 1;
  const auto count = static_cast<uint32_t>(size);
  uint8_t numbers[kHeader];
  protocol::put_u32(numbers, kMagic);
  protocol::put_u32(numbers + 4, sequence);
  protocol::put_u32(numbers + 8, count);
  protocol::put_u32(numbers + 12, crc_of(sequence, bytes, count));
  copy_boot2();
  {
    const IrqLock lock;
    // Erasing a sector takes up to 400 ms, which is the watchdog's time. So the watchdog gets three times
    // that once.
    reg(watchdog::load) = 2 * 1'200'000;
    replace_sector(rom, offset_of(slot), numbers, bytes, count);
  }
  Header written{};
  return sound(slot, written) && written.sequence == sequence;
}

}  // namespace symrig::pico
