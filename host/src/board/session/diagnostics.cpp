// SPDX-License-Identifier: Apache-2.0
#include "board/session/refusal.hpp"
#include "board/session/session.hpp"

#include <fmt/format.h>

namespace symrig {
namespace {

BoardCrash to_crash(const symrig_wire_Crash& crash) {
  return {crash.exception, crash.pc, crash.lr,
          crash.psr,       crash.sp, {crash.r0, crash.r1, crash.r2, crash.r3, crash.r12}};
}

/// The RP2040's revision number of B0 and B1; B2 has 2.
constexpr std::uint32_t kRp2040B1 = 1;

}  // namespace

Result<std::optional<BoardDiagnostics>> Board::Session::diagnostics() {
  symrig_wire_Request request = symrig_wire_Request_init_zero;
  request.which_body = symrig_wire_Request_get_diagnostics_tag;
  SYMRIG_TRY(const auto reply, wire_.request(request));
  if (protocol::raw(reply.code) == symrig_wire_Code_CODE_UNKNOWN_REQUEST)
    return std::optional<BoardDiagnostics>();
  if (protocol::raw(reply.code) != symrig_wire_Code_CODE_OK)
    return board::explain_refusal(reply, "diagnostics", info_);
  if (reply.which_body != symrig_wire_Reply_diagnostics_tag)
    return Error{ErrorCode::protocol, "the board's answer to diagnostics is not valid",
                 "host and board have different schemas: update the older one"};
  const symrig_wire_DiagnosticsReply& told = reply.body.diagnostics;
  BoardDiagnostics found{told.longest_round, told.worst_refill,    told.flash_reads,
                         told.flash_hits,    told.queue_overflows, told.dma_errors,
                         told.stack_free,    told.chip_revision,   {}};
  if (told.has_crash) found.crash = to_crash(told.crash);
  return std::optional(found);
}

std::vector<std::string> BoardDiagnostics::objections(const BoardInfo& info) const {
  std::vector<std::string> found;
  if (longest_round > info.poll_ticks)
    found.push_back(
        fmt::format("a round of the main loop took {} ticks, but the board promises {}: programs "
                    "that it accepts may run out of words",
                    longest_round, info.poll_ticks));
  if (worst_refill > info.refill_ticks)
    found.push_back(
        fmt::format("a refill took {} ticks a record, but the board promises {}: programs that it "
                    "accepts may run out of words",
                    worst_refill, info.refill_ticks));
  if (queue_overflows > 0)
    found.push_back(fmt::format("{} words went to a full queue and were lost", queue_overflows));
  if (dma_errors > 0) found.push_back(fmt::format("DMA stopped by a bus error, {} times", dma_errors));
  if (info.board == "pico" && chip_revision == kRp2040B1)
    found.emplace_back(
        "the chip is older than B2: on a busy bus, USB may not come up (erratum RP2040-E5); use a newer "
        "Pico");
  return found;
}

}  // namespace symrig
