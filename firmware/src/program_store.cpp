// SPDX-License-Identifier: Apache-2.0
#include "symrig/firmware/program_store.hpp"

namespace symrig::firmware {

using protocol::DataChunk;
using protocol::ProgramRules;

bool ProgramStore::begin(uint32_t program_id, uint32_t length) {
  drop();
  if (length == 0 || length % protocol::kRecordSize != 0 || length > memory_.size) return false;
  program_id_ = program_id;
  length_ = length;
  open_ = true;
  return true;
}

bool ProgramStore::add(const DataChunk& chunk) {
  const bool fits = open_ && !working() && chunk.program_id == program_id_ && chunk.offset == received_ &&
                    chunk.bytes.size <= length_ - received_;
  if (!fits) {
    broken_ = true;
    return false;
  }
  const auto begin = static_cast<size_t>(received_);
  for (size_t i = 0; i < chunk.bytes.size; ++i) memory_[begin + i] = chunk.bytes[i];
  received_ += static_cast<uint32_t>(chunk.bytes.size);
  return true;
}

ProgramStore::Verdict ProgramStore::commit(uint32_t program_id, uint32_t crc, const ProgramRules& rules) {
  if (!open_ || program_id != program_id_) return Verdict::wrong_program;
  if (broken_ || received_ != length_) return Verdict::incomplete;
  expected_ = crc;
  rules_ = rules;
  read_from_start(Job::read_to_commit);
  return Verdict::pending;
}

ProgramStore::Verdict ProgramStore::verify() {
  expected_ = committed_;
  read_from_start(Job::read_to_verify);
  return Verdict::pending;
}

void ProgramStore::read_from_start(Job job) {
  job_ = job;
  reading_ = {};
  read_ = 0;
}

ProgramStore::Verdict ProgramStore::work() {
  const Verdict verdict = job_ == Job::check ? check_on() : read_on();
  if (verdict != Verdict::pending) job_ = Job::none;
  return verdict;
}

ProgramStore::Verdict ProgramStore::read_on() {
  const protocol::ByteView slice =
      program().bytes.part(static_cast<size_t>(read_), static_cast<size_t>(kLooks) * protocol::kRecordSize);
  reading_.add(slice);
  read_ += static_cast<uint32_t>(slice.size);
  if (read_ < length_) return Verdict::pending;
  crc_ = reading_.value();
  if (crc_ != expected_) return Verdict::crc_mismatch;
  if (job_ == Job::read_to_verify) return Verdict::good;
  job_ = Job::check;
  first_ = {};
  check_.restart();
  return Verdict::pending;
}

ProgramStore::Verdict ProgramStore::check_on() {
  if (!check_.advance(program(), kLooks)) return Verdict::pending;
  loaded_ = check_.sound();
  if (!loaded_) return Verdict::broken_rule;
  committed_ = crc_;
  open_ = false;
  return Verdict::good;
}

void ProgramStore::drop() {
  job_ = Job::none;
  open_ = false;
  broken_ = false;
  loaded_ = false;
  length_ = 0;
  received_ = 0;
}

}  // namespace symrig::firmware
