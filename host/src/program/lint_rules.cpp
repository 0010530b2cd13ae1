// SPDX-License-Identifier: Apache-2.0
#include "symrig/program/compile.hpp"

#include <array>

namespace symrig {
namespace {

// An example begins with "symrig = 1". The board's own rules come last: protocol/PROTOCOL.md explains them.
constexpr std::array kRules{
    LintRule{"bracket.duplicate", "the bracket contains an exposure twice", Severity::warning,
             "Two exposures of a bracket are equal. The second one adds no range.",
             R"([program]
patterns = 8
)",
             R"(bracket = ["1 ms", "4 ms", "1 ms"]
)",
             R"(bracket = ["1 ms", "4 ms"]
)",
             ""},
    LintRule{"camera.min_exposure", "an exposure is shorter than the camera or the board allows",
             Severity::error,
             "An exposure is shorter than the camera's min_exposure, or its pulse is shorter than the\n"
             "board's shortest word. That also holds for start-up exposures and for pulses of steps.",
             R"([program]
patterns = 8
)",
             R"(bracket = ["5 us", "4 ms"]
)",
             R"(bracket = ["20 us", "4 ms"]
)",
             ""},
    LintRule{"camera.overlap", "an exposure would end before the readout of the last frame", Severity::error,
             "overlap_time_max (Basler: ExposureOverlapTimeMax) is longer than the shortest exposure. The\n"
             "exposure would end before the readout, and the camera drops the frame.",
             R"([rig.camera]
profile = "basler-trigger-width"
)",
             R"(overlap_time_max = "3 ms"
)",
             R"(overlap_time_max = "1 ms"
)",
             R"(
[program]
patterns = 8
bracket = ["1 ms", "4 ms"]
)"},
    LintRule{"camera.readout", "a trigger comes before the readout of the last frame ends", Severity::error,
             "A trigger comes while the camera still reads out the last frame (overtrigger): every later\n"
             "frame is then one off. Or a gap is shorter than the board's shortest level. Without gap the\n"
             "compiler uses the shortest legal one.",
             R"([program]
patterns = 8
bracket = ["1 ms", "4 ms"]
)",
             R"(gap = "1 ms"
)",
             R"(gap = "4 ms"
)",
             ""},
    LintRule{"delay.crosses",
             "the delay of a line moves an edge beyond a wait, a loop end or the program's end",
             Severity::error,
             "A line's delay carries an edge over a wait or the end of a loop. Hold longer before it.",
             R"([rig.lines.lamp_enable]
delay = "10 us"

[program]
steps = [
  { pulse = "lamp_enable", width = "1 ms" },
)",
             "",
             R"(  { hold = "10 us" },
)",
             R"(  { wait = "vsync", timeout = "50 ms" },
]
)"},
    LintRule{
        "hold.added", "an edge stands right before a loop or its end, so the board's shortest time is added",
        Severity::warning,
        "An edge stands right before a loop or the end of a loop. The board's shortest time is added\n"
        "in each round: here 10 ms become 10.00004 ms.",
        "[program]\n",
        R"(steps = [{ loop = 100, steps = [{ hold = "9 ms" }, { pulse = "projector_trigger", width = "1 ms" }] }]
)",
        R"(steps = [{ loop = 100, steps = [{ hold = "8 ms" }, { pulse = "projector_trigger", width = "1 ms" }, { hold = "1 ms" }] }]
)",
        ""},
    LintRule{
        "interlock", "the line cannot be an interlock on this board", Severity::error,
        "The line has role = \"interlock\", but cannot be an interlock on this board. symrig info shows\n"
        "which lines can. The examples are for a board on which vsync can, and camera_strobe cannot.",
        "", "[rig.lines.camera_strobe]\n", "[rig.lines.vsync]\n", R"(role = "interlock"
trip = "low"

[program]
steps = [{ hold = "1 ms" }]
)"},
    LintRule{"keep_alive.needed", "a lamp or laser line has no keep-alive, or the keep-alive is too long",
             Severity::error,
             "A lamp or laser line needs a keep-alive: at most 60 s, with a laser at most 500 ms. With it,\n"
             "the board makes its outputs safe if the host dies.",
             "[rig]\n", R"(keep_alive = "0 s"
)",
             R"(keep_alive = "1 s"
)",
             R"(
[rig.lines.lamp_enable]
role = "lamp"
max_on = "100 ms"

[program]
patterns = 8
bracket = ["1 ms", "4 ms"]
)"},
    LintRule{"lamp.limit", "the lamp would be on for longer than its max_on", Severity::error,
             "The lamp is on from each pattern to the end of its last exposure, longer than its max_on.\n"
             "Let it go off between exposures, or shorten the bracket.",
             R"([rig.lines.lamp_enable]
role = "lamp"
max_on = "8 ms"

[program]
patterns = 8
bracket = ["1 ms", "4 ms"]
lamp = "lamp_enable"
)",
             "",
             R"(advance = "exposure"
)",
             ""},
    LintRule{"lamp.unlimited", "a lamp or laser line has no max_on", Severity::warning,
             "A lamp or laser line has no max_on, so only the program switches it off. With a laser this\n"
             "is an error. A line without a table counts as a lamp if it is the scan's lamp, or if its\n"
             "name has \"lamp\" or \"laser\" in it.",
             R"([rig.lines.lamp_enable]
role = "lamp"
)",
             "",
             R"(max_on = "100 ms"
)",
             R"(
[program]
patterns = 8
bracket = ["1 ms", "4 ms"]
)"},
    LintRule{"line.direction", "the program uses an input as an output, or an output as an input",
             Severity::error, "The program uses an input as an output, or an output as an input.",
             "[program]\n", R"(steps = [{ pulse = "vsync", width = "1 ms" }, { hold = "1 ms" }]
)",
             R"(steps = [{ pulse = "lamp_enable", width = "1 ms" }, { hold = "1 ms" }]
)",
             ""},
    LintRule{
        "line.role", "the program needs a role that no line has", Severity::error,
        "The program needs a projector line, a camera line or (with sync = \"vsync\") a vsync line, and\n"
        "no line has that role.",
        "[rig.lines.camera_trigger]\n", R"(role = "general"
)",
        R"(role = "camera"
)",
        R"(
[program]
patterns = 8
bracket = ["1 ms", "4 ms"]
)"},
    LintRule{"line.unknown", "the board has no line of that name", Severity::error,
             "The board has no line of that name. The finding lists them.", "", "[rig.lines.lamp]\n",
             "[rig.lines.lamp_enable]\n", R"(role = "lamp"
max_on = "100 ms"

[program]
patterns = 8
bracket = ["1 ms", "4 ms"]
)"},
    LintRule{"loop.levels", "a loop ends with another level of a line than it began", Severity::error,
             "At the end of a loop, a line has another level than at its start, so the second round would\n"
             "differ.",
             R"([program]
steps = [
)",
             R"(  { loop = 3, steps = [{ set = "lamp_enable", to = "on" }, { hold = "1 ms" }] },
)",
             R"(  { loop = 3, steps = [
    { set = "lamp_enable", to = "on" }, { hold = "1 ms" },
    { set = "lamp_enable", to = "off" }, { hold = "1 ms" },
  ] },
)",
             "]\n"},
    LintRule{"marker.exposure", "the start marker would lengthen an exposure, or mark nothing",
             Severity::error,
             "The start marker lengthens the first pulse of its line. That line is the trigger of a\n"
             "trigger-width camera, or has no pulses.",
             R"([program]
patterns = 8
bracket = ["1 ms"]
)",
             R"(start_marker = { line = "camera_trigger", stretch = "100 us" }
)",
             R"(start_marker = { line = "projector_trigger", stretch = "100 us" }
)",
             ""},
    LintRule{"profile.assumption", "a number of a device profile has no source", Severity::note,
             "A number of the device profile is not from the maker's documents. Measure it and set it in\n"
             "the program: the note disappears.",
             "", "",
             R"([rig.camera]
profile = "generic-strobed"
min_exposure = "20 us"
readout = "4 ms"

[rig.projector]
profile = "hdmi-60"
advance_pulse = "100 us"
settle = "1 ms"

)",
             R"([program]
patterns = 8
bracket = ["1 ms", "4 ms"]
)"},
    LintRule{"projector.beat", "an exposure is not a whole number of the projector's light periods",
             Severity::warning,
             "An exposure is not a whole number of the projector's light_period, so its light depends on\n"
             "when it begins. The finding gives the largest difference, for a light that is on half the\n"
             "time.",
             R"([rig.projector]
profile = "hdmi-60"
light_period = "8.333333 ms"

[program]
patterns = 8
)",
             R"(bracket = ["2 ms", "25 ms"]
)",
             R"(bracket = ["8.333333 ms", "25 ms"]
)",
             ""},
    LintRule{"projector.black_insertion", "an exposure includes the black at a pattern's end",
             Severity::error,
             "An exposure includes the black with which some triggered projectors (DLPC900) end the\n"
             "on_time of a pattern.",
             R"([rig]
projector = "dlpc900"

[program]
patterns = 8
bracket = ["1 ms", "4 ms"]
)",
             R"(on_time = "9.05 ms"
)",
             R"(on_time = "9.115 ms"
)",
             ""},
    LintRule{"projector.min_exposure", "a pattern is shown for less than its bit depth needs",
             Severity::error,
             "The on_time is too short for this bit depth. It is a warning if the profile has no limit for\n"
             "the depth.",
             R"([rig]
projector = "dlpc900"

[program]
patterns = [{ count = 8, bits = 8 }]
bracket = ["5 ms"]
)",
             R"(on_time = "1 ms"
)",
             R"(on_time = "4.046 ms"
)",
             ""},
    LintRule{"projector.on_time", "how long the projector must show each pattern", Severity::note,
             "For this time a triggered projector must show each pattern. Set it in the projector, and\n"
             "here as on_time: the linter then checks it.",
             R"([rig]
projector = "dlpc900"

[program]
patterns = 8
bracket = ["1 ms", "4 ms"]
)",
             "",
             R"(on_time = "9.115 ms"
)",
             ""},
    LintRule{"projector.planes", "exposures or patterns do not fit into the bit planes of a picture",
             Severity::error,
             "With sync = \"plane\", pattern k is bit plane k of a picture. Its exposures must end within\n"
             "the plane, the camera must be ready before the next one, and all planes must fit into a\n"
             "refresh.",
             R"([rig]
projector = "lightcrafter-4500-video"
[rig.lines.camera_strobe]
role = "plane"

[program]
patterns = 1
)",
             R"(bracket = ["1 ms"]
)",
             R"(bracket = ["674 us"]
)",
             ""},
    LintRule{"projector.whole_refresh", "the exposure of a multi-bit pattern is not whole refreshes",
             Severity::error,
             "An exposure of a pattern of several bits is not a whole number of refreshes, and sees wrong\n"
             "grey levels. With a projector that shows a pattern once after its trigger, it must include\n"
             "the whole pattern, with a trigger for each exposure (advance = \"exposure\").",
             R"([program]
patterns = [{ count = 8, bits = 8 }]
)",
             R"(bracket = ["17 ms", "30 ms"]
)",
             R"(bracket = ["16.666667 ms", "33.333334 ms"]
)",
             ""},
    LintRule{"rounding", "rounding to ticks changes a duration by more than a thousandth", Severity::warning,
             "Rounding to the board's ticks changes a duration by more than a thousandth. If nothing\n"
             "remains of it, this is an error.",
             "[program]\n", R"(steps = [{ pulse = "lamp_enable", width = "100 ns" }, { hold = "1 ms" }]
)",
             R"(steps = [{ pulse = "lamp_enable", width = "104 ns" }, { hold = "1 ms" }]
)",
             ""},
    LintRule{"settle", "an exposure begins before the pattern is steady", Severity::error,
             "Exposures begin before the pattern is steady. It is a warning if the projector's settle is\n"
             "an assumption.",
             R"([rig.projector]
profile = "hdmi-60"
settle = "2 ms"

[program]
patterns = 8
bracket = ["1 ms"]
)",
             R"(settle = "500 us"
)",
             R"(settle = "2 ms"
)",
             ""},
    LintRule{"trigger_pulse", "a trigger pulse is too short for the board, or too long for the projector",
             Severity::error,
             "advance_pulse or trigger_pulse is shorter than the board's shortest word, or so long that\n"
             "its VSYNC has already passed.",
             R"([rig.projector]
profile = "hdmi-60"
)",
             R"(advance_pulse = "20 ms"
)",
             R"(advance_pulse = "100 us"
)",
             R"(
[program]
patterns = 8
bracket = ["1 ms"]
)"},
    LintRule{"wait.timeout", "a time-out is 0, longer than the board can count, or shorter than a refresh",
             Severity::error,
             "A time-out is 0, or longer than one record of the board, or shorter than a refresh of the\n"
             "projector.",
             "[program]\n", R"(steps = [{ wait = "vsync", timeout = "60 s" }, { hold = "1 ms" }]
)",
             R"(steps = [{ wait = "vsync", timeout = "30 s" }, { hold = "1 ms" }]
)",
             ""},
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
