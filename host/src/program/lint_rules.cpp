// SPDX-License-Identifier: Apache-2.0
#include "symrig/program/compile.hpp"

#include <array>

namespace symrig {
namespace {

constexpr std::array kRules{
    LintRule{"bracket.duplicate", "an exposure stands in the bracket twice"},
    LintRule{"camera.min_exposure", "an exposure is shorter than the camera or the board can make it"},
    LintRule{"camera.overlap", "an exposure would end before the readout of the frame before it"},
    LintRule{"camera.readout", "a trigger comes before the frame before it is read out"},
    LintRule{"delay.crosses", "the delay of a line carries an edge over a wait, a loop's end or the end"},
    LintRule{"interlock", "a line that cannot be an interlock on this board"},
    LintRule{"keep_alive.needed", "a lamp or laser line without a keep-alive, or one out of range"},
    LintRule{"lamp.limit", "the lamp would be on for longer than its max_on"},
    LintRule{"lamp.unlimited", "a lamp or laser line without max_on"},
    LintRule{"line.direction", "a line is used the wrong way round"},
    LintRule{"line.role", "the program needs a line of a role that no line has"},
    LintRule{"line.unknown", "the board has no line of that name"},
    LintRule{"loop.levels", "a loop leaves a line other than it found it"},
    LintRule{"marker.exposure", "the start marker would lengthen an exposure, or mark nothing"},
    LintRule{"profile.assumption", "a number of a device profile has no source"},
    LintRule{"projector.beat", "an exposure is no whole number of the periods in which white is made up"},
    LintRule{"projector.black_insertion", "an exposure reaches into the black at a pattern's end"},
    LintRule{"projector.min_exposure", "a pattern is shown for less than its bit depth needs"},
    LintRule{"projector.on_time", "how long the projector has to show each pattern"},
    LintRule{"projector.whole_refresh", "a multi-bit pattern is not exposed for whole refreshes"},
    LintRule{"rounding", "the board's clock cannot give a duration to a thousandth"},
    LintRule{"settle", "an exposure begins before the pattern is steady"},
    LintRule{"trigger_pulse", "a trigger pulse is too short for the board, or too long for the projector"},
    LintRule{"wait.timeout", "a time-out is 0, longer than the board can count, or shorter than a refresh"},
    LintRule{"length", "board: the program is too long"},
    LintRule{"bad_op", "board: no such operation"},
    LintRule{"bad_arg", "board: bits are set that mean nothing"},
    LintRule{"min_dwell", "board: levels stand for too short"},
    LintRule{"max_dwell", "board: levels stand for too long"},
    LintRule{"not_an_output", "board: a level for a line that is no output"},
    LintRule{"not_an_input", "board: a wait on a line that is no input"},
    LintRule{"loop_depth", "board: too many loops in each other"},
    LintRule{"loop_balance", "board: loop and end_loop do not pair"},
    LintRule{"loop_rounds", "board: 0 rounds"},
    LintRule{"idle_loop", "board: a loop whose body takes no time"},
    LintRule{"mark_crowd", "board: too many marks at one moment"},
    LintRule{"no_end", "board: End is missing"},
    LintRule{"too_long", "board: the program may run for too long"},
    LintRule{"max_on", "board: a line is on for longer than its max_on"},
    LintRule{"min_off", "board: a line is off for less than its min_off"},
    LintRule{"duty", "board: a line rests too little after a pulse"},
    LintRule{"refill", "board: short words follow each other for too long"},
    LintRule{"wait_kind", "board: it cannot wait for this edge on this line"},
    LintRule{"config", "board: the configuration of a line makes no sense"},
};

}  // namespace

std::span<const LintRule> lint_rules() {
  return kRules;
}

}  // namespace symrig
