// SPDX-License-Identifier: Apache-2.0
#include "board_pins.hpp"
#include "edge_engine.hpp"

namespace symrig::pico {
namespace {

constexpr uint32_t kRingBits = 13;
constexpr uint32_t kGrantBits = 8;

__attribute__((section(".rings.segments"),
               aligned(1U << kRingBits))) volatile uint32_t words[SegmentRing::kWords];
__attribute__((section(".rings.grants"), aligned(1U << kGrantBits))) volatile uint32_t grants[64];
static_assert(sizeof words == 1U << kRingBits && sizeof grants == 1U << kGrantBits);

constexpr uint32_t kData = dma::channel(kDmaEngineData);
constexpr uint32_t kControl = dma::channel(kDmaEngineControl);

void stop(uint32_t channel) {
  reg(channel + dma::al1_ctrl) = 0;
  reg(dma::abort) = 1U << ((channel - dma::base) / 0x40);
  while ((reg(channel + dma::al1_ctrl) & dma::busy) != 0) {
  }
}

bool take_error(uint32_t channel) {
  if ((reg(channel + dma::al1_ctrl) & dma::errors) == 0) return false;
  reg(channel + dma::al1_ctrl + kSet) = dma::errors;  // writing 1 clears them
  return true;
}

}  // namespace

SYMRIG_RAM void SegmentRing::reset() {
  stop(kControl);
  stop(kData);
  stop(kControl);  // the end of the data channel may have started it
  for (volatile uint32_t& grant : grants) grant = 0;
  written_ = granted_ = read_ = grants_ = 0;
  open_ = false;
  reg(kData + dma::read_addr) = address_of(words);
  reg(kData + dma::write_addr) = pio::pio0 + pio::txf0;
  reg(kData + dma::al1_ctrl) = dma::enable | dma::high_priority | dma::word | dma::incr_read |
                               dma::ring(kRingBits) | dma::chain(kDmaEngineControl) |
                               dma::dreq(dma::dreq_pio0_tx0) | dma::irq_quiet;
  reg(kControl + dma::read_addr) = address_of(grants);
  reg(kControl + dma::write_addr) = kData + dma::al1_trans_count_trig;
  reg(kControl + dma::trans_count) = 1;
  reg(kControl + dma::al1_ctrl) = dma::enable | dma::high_priority | dma::word | dma::incr_read |
                                  dma::ring(kGrantBits) | dma::chain(kDmaEngineControl) | dma::unpaced;
  reg(dma::intr) = (1U << kDmaEngineData) | (1U << kDmaEngineControl);
}

SYMRIG_RAM void SegmentRing::write(uint32_t first, uint32_t second) {
  volatile uint32_t* at = words + (written_ % kWords);
  at[0] = first;
  at[1] = second;
  written_ += 2;
  if (written_ - granted_ >= kGrantEvery) grant();
}

SYMRIG_RAM uint32_t SegmentRing::place() {
  return (reg(kData + dma::read_addr) - address_of(words)) / 4;
}

SYMRIG_RAM void SegmentRing::grant() {
  {
    const IrqLock lock;  // interrupts read these 64 bits
    read_ = read_words();
  }
  const auto fresh = static_cast<uint32_t>(written_ - granted_);
  if (fresh == 0 || grants_unread() >= kGrants - 2) return;
  grants[(grants_ + 1) % kGrants] = 0;
  asm volatile("dmb" ::: "memory");
  grants[grants_ % kGrants] = fresh;
  asm volatile("dmb" ::: "memory");
  ++grants_;
  granted_ = written_;
}

uint32_t SegmentRing::grants_unread() const {
  // A stopped control channel has also read the zero after the last grant.
  const uint32_t read = (reg(kControl + dma::read_addr) - address_of(grants)) / 4;
  const uint32_t ahead = (grants_ - read) % kGrants;
  return ahead == kGrants - 1 ? 0 : ahead;
}

SYMRIG_RAM void SegmentRing::open() {
  open_ = true;
  reg(kControl + dma::al3_read_addr_trig) = address_of(grants);
}

SYMRIG_RAM void SegmentRing::service() {
  if (grants_unread() <= 1) grant();
  if (take_error(kData) || take_error(kControl)) {
    ++errors_;
    open_ = false;  // its interrupt flag looks like that of a zero: a restart would repeat a grant
  }
  if (open_) restart();
}

SYMRIG_RAM void SegmentRing::restart() const {
  if ((reg(dma::intr) & (1U << kDmaEngineData)) == 0) return;
  const uint32_t zero = (reg(kControl + dma::read_addr) - address_of(grants)) / 4 - 1;
  if (zero % kGrants == grants_ % kGrants) return;  // no new grants
  reg(dma::intr) = 1U << kDmaEngineData;
  reg(kControl + dma::al3_read_addr_trig) = address_of(grants + zero % kGrants);
}

SYMRIG_RAM uint64_t SegmentRing::read_words() const {
  return read_ + (place() - static_cast<uint32_t>(read_)) % kWords;
}

}  // namespace symrig::pico
