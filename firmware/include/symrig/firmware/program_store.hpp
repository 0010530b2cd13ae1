// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "symrig/protocol/check_program.hpp"
#include "symrig/protocol/messages.hpp"

namespace symrig::firmware {

/// The program of a board: chunks fill it, and a commit checks its CRC and the rules. A small processor needs
/// longer than one poll to read a whole program. So commit and verify are jobs, and work() does them in
/// slices.
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
  /// Stores the next chunk. false: not begun, another program, out of order, or beyond the length. Then the
  /// upload cannot be committed.
  bool add(const protocol::DataChunk& chunk);

  enum class Verdict : uint8_t { pending, good, wrong_program, incomplete, crc_mismatch, broken_rule };
  /// The pointers in `rules` must outlive the store. pending: work() will return the verdict.
  Verdict commit(uint32_t program_id, uint32_t crc, const protocol::ProgramRules& rules);
  /// Reads the program again and compares it with the committed one. Only if loaded(). Returns pending.
  Verdict verify();
  /// One slice of the job: at most kLooks records. pending: the job is not finished. Only if working().
  Verdict work();
  bool working() const { return job_ != Job::none; }
  void drop();

  uint32_t received() const { return received_; }
  uint32_t crc() const { return crc_; }
  /// Valid after broken_rule.
  const protocol::Violation& violation() const { return first_.found; }

  bool loaded() const { return loaded_; }
  /// 0 if nothing is loaded.
  uint32_t hash() const { return loaded_ ? committed_ : 0; }
  // Valid if loaded().
  const protocol::ProgramTiming& timing() const { return check_.timing(); }
  const protocol::LineUse& use(unsigned line) const { return check_.use(line); }
  protocol::ProgramView program() const { return {{memory_.data, static_cast<size_t>(length_)}}; }

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
  uint32_t expected_ = 0;   // CRC from the host
  uint32_t crc_ = 0;        // CRC of the last reading
  uint32_t committed_ = 0;  // CRC of the committed program
  bool open_ = false;
  bool broken_ = false;
  bool loaded_ = false;
};

}  // namespace symrig::firmware
