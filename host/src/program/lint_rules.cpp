// SPDX-License-Identifier: Apache-2.0
#include "symrig/program/compile.hpp"

#include <array>

namespace symrig {
namespace {

constexpr std::array kRules{
    LintRule{"bracket.duplicate", "the bracket contains an exposure twice"},
    LintRule{"camera.min_exposure", "an exposure is shorter than the camera or the board allows"},
    LintRule{"camera.overlap", "an exposure would end before the readout of the last frame"},
    LintRule{"camera.readout", "a trigger comes before the readout of the last frame ends"},
    LintRule{"delay.crosses",
             "the delay of a line moves an edge beyond a wait, a loop end or the program's end"},
    LintRule{"hold.added",
             "an edge stands right before a loop or its end, so the board's shortest time is added"},
    LintRule{"interlock", "the line cannot be an interlock on this board"},
    LintRule{"keep_alive.needed", "a lamp or laser line has no keep-alive, or the keep-alive is too long"},
    LintRule{"lamp.limit", "the lamp would be on for longer than its max_on"},
    LintRule{"lamp.unlimited", "a lamp or laser line has no max_on"},
    LintRule{"line.direction", "the program uses an input as an output, or an output as an input"},
    LintRule{"line.role", "the program needs a role that no line has"},
    LintRule{"line.unknown", "the board has no line of that name"},
    LintRule{"loop.levels", "a loop ends with another level of a line than it began"},
    LintRule{"marker.exposure", "the start marker would lengthen an exposure, or mark nothing"},
    LintRule{"profile.assumption", "a number of a device profile has no source"},
    LintRule{"projector.beat", "an exposure is not a whole number of the projector's light periods"},
    LintRule{"projector.black_insertion", "an exposure includes the black at a pattern's end"},
    LintRule{"projector.min_exposure", "a pattern is shown for less than its bit depth needs"},
    LintRule{"projector.on_time", "how long the projector must show each pattern"},
    LintRule{"projector.planes", "exposures or patterns do not fit into the bit planes of a picture"},
    LintRule{"projector.whole_refresh", "the exposure of a multi-bit pattern is not whole refreshes"},
    LintRule{"rounding", "rounding to ticks changes a duration by more than a thousandth"},
    LintRule{"settle", "an exposure begins before the pattern is steady"},
    LintRule{"trigger_pulse", "a trigger pulse is too short for the board, or too long for the projector"},
    LintRule{"wait.timeout", "a time-out is 0, longer than the board can count, or shorter than a refresh"},
    LintRule{"length", "board: the program is too long"},
    LintRule{"bad_op", "board: the operation does not exist"},
    LintRule{"bad_arg", "board: bits without a meaning are set"},
    LintRule{"min_dwell", "board: levels last too short"},
    LintRule{"max_dwell", "board: levels last too long"},
    LintRule{"not_an_output", "board: a level for a line that is not an output"},
    LintRule{"not_an_input", "board: a wait on a line that is not an input"},
    LintRule{"loop_depth", "board: too many nested loops"},
    LintRule{"loop_balance", "board: loop and end_loop do not pair"},
    LintRule{"loop_rounds", "board: 0 rounds"},
    LintRule{"idle_loop", "board: a loop whose body takes no time"},
    LintRule{"mark_crowd", "board: too many marks at one moment"},
    LintRule{"no_end", "board: End is missing"},
    LintRule{"too_long", "board: the program may run for too long"},
    LintRule{"max_on", "board: a line is on for longer than its max_on"},
    LintRule{"min_off", "board: a line is off for less than its min_off"},
    LintRule{"duty", "board: a line rests too little after a pulse"},
    LintRule{"refill", "board: too many short words follow each other"},
    LintRule{"wait_kind", "board: it cannot wait for this edge on this line"},
    LintRule{"config", "board: the configuration of a line is not valid"},
};

}  // namespace

std::span<const LintRule> lint_rules() {
  return kRules;
}

}  // namespace symrig
