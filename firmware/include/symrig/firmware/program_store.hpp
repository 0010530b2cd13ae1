// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/check_program.hpp"
#include "symrig/protocol/data_chunk.hpp"

namespace symrig::firmware {

/// The one program a board holds: filled by chunks, committed by CRC and by the rules. Reading a whole
/// program takes a small processor longer than one poll may: commit and verify are jobs, done in slices by
/// work().
class ProgramStore {
 public:
  explicit ProgramStore(protocol::ByteRoom memory) : memory_(memory), check_(rules_, first_) {}
  ProgramStore(const ProgramStore&) = delete;
  ProgramStore& operator=(const ProgramStore&) = delete;

  uint32_t capacity() const {
    return static_cast<uint32_t>(memory_.size / protocol::kRecordSize * protocol::kRecordSize);
  }

  /// false: length is 0, not whole records, or more than capacity().
  bool begin(uint32_t program_id, uint32_t length);
  /// Takes the next chunk, in order. false: not begun, another program, out of order, or beyond the length;
  /// the upload cannot be committed then.
  bool add(const protocol::DataChunk& chunk);

  enum class Verdict : uint8_t { pending, good, wrong_program, incomplete, crc_mismatch, broken_rule };
  /// rules point to what outlives the store. pending: work() will tell.
  Verdict commit(uint32_t program_id, uint32_t crc, const protocol::ProgramRules& rules);
  /// Reads the program again to see whether it still is what was committed. Only if loaded(). pending.
  Verdict verify();
  /// One slice of the job: at most kLooks records. pending: more is to do. Only if working().
  Verdict work();
  bool working() const { return job_ != Job::none; }
  void drop();

  uint32_t received() const { return received_; }
  uint32_t crc() const { return crc_; }
  /// Meaningful after broken_rule.
  const protocol::Violation& violation() const { return first_.found; }

  bool loaded() const { return loaded_; }
  /// 0 if nothing is loaded.
  uint32_t hash() const { return loaded_ ? committed_ : 0; }
  // Meaningful if loaded().
  const protocol::ProgramTiming& timing() const { return check_.timing(); }
  const protocol::LineUse& use(unsigned line) const { return check_.use(line); }
  protocol::ProgramView program() const { return {{memory_.data, length_}}; }

 private:
  enum class Job : uint8_t { none, read_to_commit, check, read_to_verify };
  /// Keeps the first finding and ends the search.
  struct First {
    protocol::Violation found;
    bool operator()(const protocol::Violation& violation) {
      found = violation;
      return false;
    }
  };
  static constexpr uint32_t kLooks = 256;

  void read_from_start(Job job);
  Verdict read_on();
  Verdict check_on();

  protocol::ByteRoom memory_;
  protocol::ProgramRules rules_;
  First first_;
  protocol::ProgramCheck<First> check_;
  Job job_ = Job::none;
  protocol::Crc32c reading_;
  uint32_t read_ = 0;  // bytes
  uint32_t program_id_ = 0;
  uint32_t length_ = 0;
  uint32_t received_ = 0;
  uint32_t expected_ = 0;   // CRC that the host gave
  uint32_t crc_ = 0;        // as read last
  uint32_t committed_ = 0;  // CRC under which it was committed
  bool open_ = false;
  bool broken_ = false;
  bool loaded_ = false;
};

}  // namespace symrig::firmware
