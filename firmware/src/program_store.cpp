// SPDX-License-Identifier: Apache-2.0
#include "symrig/firmware/program_store.hpp"

namespace symrig::firmware {

using protocol::DataChunk;
using protocol::ProgramRules;
using protocol::Violation;

bool ProgramStore::begin(uint32_t program_id, uint32_t length) {
  drop();
  if (length == 0 || length % protocol::kRecordSize != 0 || length > memory_.size) return false;
  program_id_ = program_id;
  length_ = length;
  open_ = true;
  return true;
}

bool ProgramStore::add(const DataChunk& chunk) {
  const bool fits = open_ && chunk.program_id == program_id_ && chunk.offset == received_ &&
                    chunk.bytes.size <= length_ - received_;
  if (!fits) {
    broken_ = true;
    return false;
  }
  for (size_t i = 0; i < chunk.bytes.size; ++i) memory_[received_ + i] = chunk.bytes[i];
  received_ += static_cast<uint32_t>(chunk.bytes.size);
  return true;
}

ProgramStore::Commit ProgramStore::commit(uint32_t program_id, uint32_t crc, const ProgramRules& rules) {
  if (!open_ || program_id != program_id_) return Commit::wrong_program;
  if (broken_ || received_ != length_) return Commit::incomplete;
  crc_ = protocol::crc32c(program().bytes);
  if (crc_ != crc) return Commit::crc_mismatch;
  violation_ = {};
  loaded_ = protocol::check_program(program(), rules, timing_, [this](const Violation& found) {
    violation_ = found;
    return false;
  });
  if (!loaded_) return Commit::broken_rule;
  open_ = false;
  return Commit::good;
}

void ProgramStore::drop() {
  open_ = false;
  broken_ = false;
  loaded_ = false;
  length_ = 0;
  received_ = 0;
}

}  // namespace symrig::firmware
