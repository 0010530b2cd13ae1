// SPDX-License-Identifier: Apache-2.0
#include "emulated_mega.hpp"

#include <array>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <stdexcept>
#include <utility>

extern "C" {
#include <simavr/avr_eeprom.h>
#include <simavr/avr_ioport.h>
#include <simavr/avr_uart.h>
#include <simavr/sim_avr.h>
#include <simavr/sim_elf.h>
#include <simavr/sim_hex.h>
#include <simavr/sim_io.h>
}

namespace symrig::test {
namespace {

/// Another image than the build's, for one that another compiler made.
std::string image() {
  const char* other = std::getenv("SYMRIG_MEGA_ELF");
  return other != nullptr ? other : SYMRIG_MEGA_IMAGE;
}

constexpr std::uint64_t kByteCycles = 1600;  // 10 bits at 115,200 baud are 1,389; simavr 1.6 needs 11 (1,503)
constexpr unsigned kFirstInput = 6;
constexpr std::uint8_t kPaint = 0xC5;
constexpr std::uint16_t kEifr = 0x3C;
constexpr std::uint16_t kTimsk3 = 0x71;
constexpr std::uint16_t kDdra = 0x21;
constexpr std::uint16_t kPorta = 0x22;
constexpr std::uint16_t kMcusr = 0x54;
constexpr std::uint8_t kByPin = 2;  // EXTRF

struct Pin {
  char port;
  unsigned bit;
};
constexpr std::array<Pin, 12> kPins{{{'A', 0},
                                     {'A', 1},
                                     {'A', 2},
                                     {'A', 3},
                                     {'A', 4},
                                     {'A', 5},
                                     {'D', 0},
                                     {'D', 1},
                                     {'D', 2},
                                     {'D', 3},
                                     {'E', 4},
                                     {'E', 5}}};

}  // namespace

struct EmulatedMega::Impl {
  struct Watched {
    Impl* board;
    unsigned line;
  };
  struct Planned {
    std::uint64_t cycle;
    unsigned line;
    bool level;
  };
  struct Chatter {
    std::uint64_t period = 0;  // 0: none
    std::uint64_t next = 0;
  };

  Impl() {
    if (elf_read_firmware(image().c_str(), &firmware) != 0)
      throw std::runtime_error(image() + " is no image");
    avr = avr_make_mcu_by_name("atmega2560");
    if (avr == nullptr) throw std::runtime_error("simavr has no atmega2560");
    avr_init(avr);
    avr->log = LOG_ERROR;
    avr->frequency = kHz;
    avr_load_firmware(avr, &firmware);
    variables_end = firmware.datasize + firmware.bsssize + 0x200;
    connect();
    clear_flags_by_ones();
    write_serial();
    paint();
  }
  ~Impl() {
    avr_terminate(avr);
    std::free(avr);
  }
  Impl(const Impl&) = delete;
  Impl& operator=(const Impl&) = delete;

  avr_irq_t* pin(unsigned line) const {
    const Pin& at = kPins.at(line);
    return avr_io_getirq(avr, static_cast<std::uint32_t>(AVR_IOCTL_IOPORT_GETIRQ(at.port)),
                         static_cast<int>(at.bit));
  }

  void connect() {
    std::uint32_t flags = 0;
    avr_ioctl(avr, AVR_IOCTL_UART_GET_FLAGS('0'), &flags);
    flags &= ~static_cast<std::uint32_t>(AVR_UART_FLAG_STDIO | AVR_UART_FLAG_POLL_SLEEP);
    avr_ioctl(avr, AVR_IOCTL_UART_SET_FLAGS('0'), &flags);
    avr_irq_register_notify(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_OUTPUT), sent, this);
    for (unsigned line = 0; line < kPins.size(); ++line) {
      watched.at(line) = {this, line};
      avr_irq_register_notify(pin(line), changed, &watched.at(line));
    }
  }

  /// simavr 1.6 stores what is written to EIFR. The chip clears the flags that are written as ones (data
  /// sheet 15.2.4).
  void clear_flags_by_ones() const { avr_register_io_write(avr, kEifr, clear_flags, nullptr); }
  static void clear_flags(avr_t* avr, avr_io_addr_t /*at*/, std::uint8_t ones, void* /*none*/) {
    for (unsigned k = 0; k < avr->interrupts.vector_count; ++k) {
      avr_int_vector_t* vector = avr->interrupts.vector[k];
      if (vector->raised.reg == kEifr && (ones >> vector->raised.bit & 1U) != 0)
        avr_clear_interrupt(avr, vector);
    }
  }

  /// What the maker writes once: the serial number in the last eight bytes of the EEPROM.
  void write_serial() const {
    std::array<std::uint8_t, 8> serial{'m', 'e', 'g', 'a', '0', '0', '0', '1'};
    avr_eeprom_desc_t place{serial.data(), 4088, 8};
    avr_ioctl(avr, AVR_IOCTL_EEPROM_SET, &place);
  }

  void paint() const {
    for (unsigned at = variables_end + 32; at <= avr->ramend; ++at) avr->data[at] = kPaint;
  }

  static void sent(avr_irq_t* /*irq*/, std::uint32_t value, void* self) {
    static_cast<Impl*>(self)->to_host.push_back(static_cast<std::uint8_t>(value));
  }
  static void changed(avr_irq_t* /*irq*/, std::uint32_t value, void* which) {
    const auto* watched = static_cast<const Watched*>(which);
    watched->board->line_changed(watched->line, (value & 1U) != 0);
  }
  void line_changed(unsigned line, bool level) {
    if (levels.at(line) == level) return;
    levels.at(line) = level;
    edges.push_back({avr->cycle, line, level});
    if (wire && wire->first == line) avr_raise_irq(pin(wire->second), level ? 1 : 0);
  }

  void shake(unsigned line) {
    Chatter& at = chatters.at(line);
    if (at.period == 0 || avr->cycle < at.next) return;
    at.next += at.period;
    avr_raise_irq(pin(line), levels.at(line) ? 0 : 1);
  }

  void step() {
    if (!to_board.empty() && avr->cycle >= next_byte) {
      avr_raise_irq(avr_io_getirq(avr, AVR_IOCTL_UART_GETIRQ('0'), UART_IRQ_INPUT), to_board.front());
      to_board.pop_front();
      next_byte = avr->cycle + kByteCycles;
    }
    for (unsigned line = kFirstInput; line < kPins.size(); ++line) shake(line);
    while (!planned.empty() && avr->cycle >= planned.front().cycle) {
      avr_raise_irq(pin(planned.front().line), planned.front().level ? 1 : 0);
      planned.pop_front();
    }
    const int state = avr_run(avr);
    driven_low |= static_cast<std::uint8_t>(avr->data[kDdra] & ~avr->data[kPorta]);
    if (state == cpu_Crashed || state == cpu_Done) throw std::runtime_error("the emulated processor crashed");
  }

  elf_firmware_t firmware{};
  avr_t* avr = nullptr;
  unsigned variables_end = 0;
  std::array<Watched, 12> watched{};
  std::array<bool, 12> levels{};
  std::vector<MegaEdge> edges;
  std::deque<Planned> planned;
  std::uint32_t driven_low = 0;
  std::array<Chatter, 12> chatters{};
  std::deque<std::uint8_t> to_board;
  std::vector<std::uint8_t> to_host;
  std::uint64_t next_byte = 0;
  std::optional<std::pair<unsigned, unsigned>> wire;
};

std::string EmulatedMega::missing() {
  if (!std::filesystem::exists(image())) return "the Mega's image is not built: tools/firmware";
  return {};
}

EmulatedMega::EmulatedMega() : impl_(std::make_unique<Impl>()) {
  run(kHz / 100);  // the firmware has started, and switched its pull-ups on
  for (unsigned line = kFirstInput; line < kPins.size(); ++line) set_input(line, false);
  run(kHz / 1000);
  edges();
}
EmulatedMega::~EmulatedMega() = default;

void EmulatedMega::run(std::uint64_t cycles) {
  const std::uint64_t end = impl_->avr->cycle + cycles;
  while (impl_->avr->cycle < end) impl_->step();
}

std::uint64_t EmulatedMega::cycle() const {
  return impl_->avr->cycle;
}

void EmulatedMega::set_input(unsigned line, bool level) {
  avr_raise_irq(impl_->pin(line), level ? 1 : 0);
}

void EmulatedMega::set_input_at(std::uint64_t cycle, unsigned line, bool level) {
  impl_->planned.push_back({cycle, line, level});
}

void EmulatedMega::chatter(unsigned line, std::uint64_t cycles) {
  impl_->chatters.at(line) = {cycles, impl_->avr->cycle + cycles};
}

void EmulatedMega::jumper(unsigned output, unsigned input) {
  impl_->wire = {output, input};
  set_input(input, impl_->levels.at(output));
}

/// An endless loop (RJMP to itself: 0xCFFF) at an even place that nothing else uses: the last word of flash.
void EmulatedMega::stop_firmware() {
  avr_t* avr = impl_->avr;
  avr->flash[avr->flashend - 1] = 0xFF;
  avr->flash[avr->flashend] = 0xCF;
  avr->pc = avr->flashend - 1;
  avr->sreg[S_I] = 0;
}

void EmulatedMega::stop_clock() {
  impl_->avr->data[kTimsk3] = 0;
}

void EmulatedMega::reset_by_pin() {
  avr_reset(impl_->avr);
  impl_->avr->data[kMcusr] = kByPin;
}

std::uint32_t EmulatedMega::take_driven_low() {
  return std::exchange(impl_->driven_low, 0U);
}

bool EmulatedMega::output(unsigned line) const {
  return impl_->levels.at(line);
}

std::vector<MegaEdge> EmulatedMega::edges() {
  return std::exchange(impl_->edges, {});
}

unsigned EmulatedMega::stack_left() const {
  unsigned at = impl_->variables_end + 32;
  while (at <= impl_->avr->ramend && impl_->avr->data[at] == kPaint) ++at;
  return at - impl_->variables_end;
}

unsigned EmulatedMega::stack_room() const {
  return impl_->avr->ramend + 1 - impl_->variables_end;
}

unsigned EmulatedMega::place(const std::string& symbol) const {
  for (std::uint32_t k = 0; k < impl_->firmware.symbolcount; ++k) {
    const avr_symbol_t& known = *impl_->firmware.symbol[k];
    if (symbol == known.symbol) return known.addr & 0xFFFFU;
  }
  return 0;
}

std::vector<std::uint8_t> EmulatedMega::variable(const std::string& symbol, unsigned bytes) const {
  const unsigned at = place(symbol);
  if (at == 0) return {};
  return {impl_->avr->data + at, impl_->avr->data + at + bytes};
}

/// The clock is a pointer to its functions and the number of its overflows, 2^16 ticks each.
void EmulatedMega::skip_time(std::uint32_t steps) {
  const unsigned at = place("_ZN6symrig8mega256012_GLOBAL__N_110tick_clockE");
  if (at == 0) throw std::runtime_error("the image has no tick_clock");
  std::uint8_t* overflows = impl_->avr->data + at + 2;
  std::uint32_t count = 0;
  for (unsigned k = 0; k < 4; ++k) count |= std::uint32_t{overflows[k]} << 8 * k;
  count += steps << 7U;
  for (unsigned k = 0; k < 4; ++k) overflows[k] = static_cast<std::uint8_t>(count >> 8 * k);
}

/// The UART as a link. Its time is the board's.
class MegaLink final : public Link {
 public:
  explicit MegaLink(EmulatedMega::Impl& board) : board_(board), opened_(board.avr->cycle) {}

  Result<void> send(std::span<const std::uint8_t> bytes) override {
    board_.to_board.insert(board_.to_board.end(), bytes.begin(), bytes.end());
    return {};
  }
  Result<std::vector<std::uint8_t>> receive(Nanoseconds timeout) override {
    const std::uint64_t end = board_.avr->cycle + cycles(timeout);
    while (board_.to_host.empty() && board_.avr->cycle < end) board_.step();
    return std::exchange(board_.to_host, {});
  }
  Nanoseconds now() const override {
    return Nanoseconds{static_cast<std::int64_t>((board_.avr->cycle - opened_) * 125 / 2)};
  }

 private:
  static std::uint64_t cycles(Nanoseconds time) {
    return static_cast<std::uint64_t>(time.count()) * 2 / 125 + 1;
  }

  EmulatedMega::Impl& board_;
  std::uint64_t opened_;
};

std::unique_ptr<Link> EmulatedMega::link() {
  return std::make_unique<MegaLink>(*impl_);
}

}  // namespace symrig::test
