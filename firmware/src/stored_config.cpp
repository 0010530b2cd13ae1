// SPDX-License-Identifier: Apache-2.0
#include "symrig/firmware/stored_config.hpp"

#include "symrig/protocol/frame.hpp"

namespace symrig::firmware {
namespace {

constexpr uint8_t kMagic[4] = {'S', 'R', 'C', '1'};
constexpr size_t kLabelAt = sizeof kMagic;
constexpr size_t kCountAt = kLabelAt + sizeof Label::text;
constexpr size_t kLinesAt = kCountAt + 4;
constexpr size_t kMaxSize = kLinesAt + protocol::kMaxLines * protocol::kLineRecordSize + protocol::kCrcSize;
static_assert(kMaxSize <= hal::Settings::kRoom);

// One record at a time is handled. It is too large for a small board's stack.
uint8_t scratch[kMaxSize];

bool sound(size_t size) {
  if (size < kLinesAt + protocol::kCrcSize) return false;
  for (size_t i = 0; i < sizeof kMagic; ++i)
    if (scratch[i] != kMagic[i]) return false;
  const size_t covered = size - protocol::kCrcSize;
  if (covered != kLinesAt + scratch[kCountAt] * protocol::kLineRecordSize) return false;
  return protocol::crc32c({scratch, covered}) == protocol::get_u32(scratch + covered);
}

}  // namespace

bool save_config(hal::Settings& settings, const protocol::BoardConfig& config, const Label& label) {
  for (size_t i = 0; i < sizeof kMagic; ++i) scratch[i] = kMagic[i];
  for (size_t i = 0; i < sizeof label.text; ++i) scratch[kLabelAt + i] = static_cast<uint8_t>(label.text[i]);
  protocol::put_u32(scratch + kCountAt, 0);
  size_t at = kLinesAt;
  for (unsigned k = 0; k < protocol::kMaxLines; ++k) {
    if (!config.lines[k].configured) continue;
    protocol::put_line_record(static_cast<uint8_t>(k), config.lines[k], scratch + at);
    at += protocol::kLineRecordSize;
    ++scratch[kCountAt];
  }
  protocol::put_u32(scratch + at, protocol::crc32c({scratch, at}));
  return settings.save(scratch, at + protocol::kCrcSize);
}

bool load_config(const hal::Settings& settings, const hal::BoardTraits& board, protocol::BoardConfig& config,
                 Label& label) {
  if (!sound(settings.load(scratch, sizeof scratch))) return false;
  for (size_t i = 0; i + 1 < sizeof label.text; ++i) label.text[i] = static_cast<char>(scratch[kLabelAt + i]);
  for (unsigned i = 0; i < scratch[kCountAt]; ++i) {
    const uint8_t* record = scratch + kLinesAt + i * protocol::kLineRecordSize;
    const protocol::LineConfig line = protocol::get_line_record(record);
    if (record[0] >= board.line_count || line.output != board.lines[record[0]].output) return false;
    config.lines[record[0]] = line;
  }
  return true;
}

}  // namespace symrig::firmware
