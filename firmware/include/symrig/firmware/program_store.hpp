// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/check_program.hpp"
#include "symrig/protocol/data_chunk.hpp"

namespace symrig::firmware {

/// The one program a board holds: filled by chunks, committed by CRC and by the rules.
class ProgramStore {
 public:
  explicit ProgramStore(protocol::ByteRoom memory) : memory_(memory) {}

  uint32_t capacity() const {
    return static_cast<uint32_t>(memory_.size / protocol::kRecordSize * protocol::kRecordSize);
  }

  /// false: length is 0, not whole records, or more than capacity().
  bool begin(uint32_t program_id, uint32_t length);
  /// Takes the next chunk, in order. false: not begun, another program, out of order, or beyond the length;
  /// the upload cannot be committed then.
  bool add(const protocol::DataChunk& chunk);

  enum class Commit : uint8_t { good, wrong_program, incomplete, crc_mismatch, broken_rule };
  Commit commit(uint32_t program_id, uint32_t crc, const protocol::ProgramRules& rules);
  void drop();

  uint32_t received() const { return received_; }
  uint32_t crc() const { return crc_; }
  /// Meaningful after a commit that returned broken_rule.
  const protocol::Violation& violation() const { return violation_; }

  bool loaded() const { return loaded_; }
  /// 0 if nothing is loaded.
  uint32_t hash() const { return loaded_ ? crc_ : 0; }
  const protocol::ProgramTiming& timing() const { return timing_; }
  protocol::ProgramView program() const { return {{memory_.data, length_}}; }

 private:
  protocol::ByteRoom memory_;
  uint32_t program_id_ = 0;
  uint32_t length_ = 0;
  uint32_t received_ = 0;
  uint32_t crc_ = 0;
  bool open_ = false;
  bool broken_ = false;
  bool loaded_ = false;
  protocol::ProgramTiming timing_;
  protocol::Violation violation_;
};

}  // namespace symrig::firmware
