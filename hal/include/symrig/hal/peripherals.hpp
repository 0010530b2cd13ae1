// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/hal/clock.hpp"

namespace symrig::hal {

/// Bytes to and from the host (USB, UART, memory). Never waits.
class ByteLink {
 public:
  /// Reads at most `room` received bytes. Returns their number.
  virtual size_t read(uint8_t* out, size_t room) = 0;
  /// The number of bytes that write() accepts now.
  virtual size_t room() const = 0;
  /// Sends `size` bytes, at most room().
  virtual void write(const uint8_t* bytes, size_t size) = 0;
  /// True if a host is connected (USB configured and not suspended; always true for a UART).
  virtual bool attached() const = 0;

 protected:
  ~ByteLink() = default;
};

/// A latched fault in the form that survives a reset.
struct FaultRecord {
  uint32_t code = 0;  ///< FaultCode of the wire; 0 = none
  Tick tick = 0;
  uint64_t arg = 0;
};

/// Memory that survives a reset (scratch registers, no-init RAM, flash). Power-off may erase it.
class FaultStore {
 public:
  /// code 0 if nothing is stored.
  virtual FaultRecord load() const = 0;
  virtual void save(const FaultRecord& record) = 0;

 protected:
  ~FaultStore() = default;
};

/// A few hundred bytes that survive power-off (flash). load() returns the last saved record. If power failed
/// during a save, it returns the record before it, never a mixture.
class Settings {
 public:
  /// The largest record in bytes.
  static constexpr size_t kRoom = 1024;

  /// Copies the record to `out` if it fits. Returns its size; 0 if no valid record is stored.
  virtual size_t load(uint8_t* out, size_t room) const = 0;
  /// Takes up to half a second, in which nothing else runs. So call it only with safe outputs. false: the
  /// write failed.
  virtual bool save(const uint8_t* bytes, size_t size) = 0;

 protected:
  ~Settings() = default;
};

/// Resets the board, with outputs at the levels of power-up, if it is not fed in time. The board sets the
/// time, at most half a second.
class Watchdog {
 public:
  virtual void feed() = 0;

 protected:
  ~Watchdog() = default;
};

/// The light that shows the board's state to a person.
class Indicator {
 public:
  virtual void show(bool on) = 0;

 protected:
  ~Indicator() = default;
};

/// The registers of a processor at a crash, in the form that survives a reset.
struct Crash {
  uint32_t exception = 0;  ///< its number; 0 = no crash is kept
  uint32_t pc = 0;
  uint32_t lr = 0;
  uint32_t psr = 0;    ///< its lower six bits: the number of the interrupted exception, 0 = the main program
  uint32_t sp = 0;     ///< before the exception
  uint32_t r[5] = {};  ///< r0 to r3, r12
};

/// What a board has measured about itself since it started. The core measures its rounds and refills itself.
struct Diagnostics {
  uint32_t flash_reads = 0;      ///< accesses to flash since all code runs from RAM; modulo 2^32
  uint32_t flash_hits = 0;       ///< those of them that the cache answered
  uint32_t queue_overflows = 0;  ///< words written to a full hardware queue
  uint32_t dma_errors = 0;
  uint32_t stack_free = 0;     ///< bytes of the stack that were never used
  uint32_t chip_revision = 0;  ///< 0 = not known
  Crash crash;                 ///< before the last reset
};

/// Refills of fewer records are not compared with refill_ticks: they say more about the interrupts that came
/// in them than about their records.
constexpr uint32_t kRefillSample = 256;

/// Why the board started. Values are those of the wire.
enum class ResetCause : uint8_t { power = 0, pin = 1, watchdog = 2, request = 3 };

/// The chip as a whole.
class System {
 public:
  virtual ResetCause reset_cause() const = 0;
  /// Restarts the chip; in the boot loader, if requested and present. May return before the restart.
  virtual void reboot(bool bootloader) = 0;
  /// false: the board measures nothing about itself.
  virtual bool diagnose(Diagnostics& /*out*/) const { return false; }

 protected:
  ~System() = default;
};

}  // namespace symrig::hal
