// SPDX-License-Identifier: Apache-2.0
#include "report/alignment_words.hpp"

#include "symrig/report/alignment_summary.hpp"
#include "symrig/report/text.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include <fmt/format.h>

namespace symrig {
namespace {

/// Names of the 3 × 3 parts of a picture.
constexpr std::array<const char*, 9> kParts{"upper left", "top",        "upper right", "left",       "middle",
                                            "right",      "lower left", "bottom",      "lower right"};

/// "7.3 cells up and 4.1 cells left": where to aim a camera that looks this far beside.
std::string aim(const Point& shift) {
  constexpr double kLeast = 0.005;  // [cells]
  std::string text;
  if (std::abs(shift.row) > kLeast)
    text = fmt::format("{:.2g} cells {}", std::abs(shift.row), shift.row > 0 ? "up" : "down");
  if (std::abs(shift.col) > kLeast)
    text += fmt::format("{}{:.2g} cells {}", text.empty() ? "" : " and ", std::abs(shift.col),
                        shift.col > 0 ? "left" : "right");
  return text.empty() ? "at the middle" : text;
}

/// A camera whose picture is smaller than the cells must see more; another one must only look elsewhere.
std::string see_all(const Alignment& a) {
  const double pixels = a.shape.pixels_per_cell;
  const double missing =
      std::max(a.cells.rows * pixels / a.camera.rows, a.cells.cols * pixels / a.camera.cols);
  std::string where = "aim the camera " + aim(a.shape.shift);
  if (missing <= 1) return where;
  return fmt::format("zoom out {:.2f} times or move the camera back, and {}", missing, where);
}

/// The part of the offset that moves the corner of the picture most.
std::string sit_on_cells(const Alignment& a) {
  const MapShape& s = a.shape;
  const double corner = 0.5 * std::hypot(a.cells.rows, a.cells.cols);
  const double turn = corner * std::abs(s.turn) * std::numbers::pi / 180,
               zoom = corner * std::abs(s.pixels_per_cell - 1);
  const double shift = std::hypot(s.shift.row, s.shift.col);
  if (s.mirrored) return "the picture is mirrored: mirror it in camera or projector";
  if (turn >= std::max(zoom, shift))
    return fmt::format("turn the camera by {:.2g}° {}", std::abs(s.turn),
                       s.turn > 0 ? "counter-clockwise" : "clockwise");
  if (zoom >= shift)
    return fmt::format("zoom {} by {:.2g} %", s.pixels_per_cell > 1 ? "out" : "in",
                       100 * std::abs(s.pixels_per_cell - 1));
  return "aim the camera " + aim(s.shift);
}

std::string focus_at(const Alignment& a) {
  const auto* const worst = std::ranges::max_element(a.focus, {}, &TileFocus::blur);
  return fmt::format("focus projector and camera; worst at the {} of the picture",
                     kParts[static_cast<std::size_t>(worst - a.focus.begin())]);
}

/// "up or down", by the larger component.
std::string move_along(const Point& direction) {
  const double rows = std::abs(direction.row), cols = std::abs(direction.col);
  if (rows > 2 * cols) return "up or down";
  if (cols > 2 * rows) return "left or right";
  return direction.row * direction.col > 0 ? "to the lower right or upper left"
                                           : "to the upper right or lower left";
}

}  // namespace

std::string advice(const AlignmentFinding& finding, const Alignment& a) {
  switch (finding.goal) {
    case AlignmentGoal::stripes:
      return a.glimpse
                 ? "the camera sees too few cells: aim it " + aim(*a.glimpse)
                 : std::string(
                       "the camera sees no stripes: aim it at what the projector lights, and focus both");
    case AlignmentGoal::cells:
      return see_all(a);
    case AlignmentGoal::pixels:
      return "zoom in, move the camera closer, or make the cells larger";
    case AlignmentGoal::offset:
      return sit_on_cells(a);
    case AlignmentGoal::focus:
      return focus_at(a);
    case AlignmentGoal::parallax:
      return fmt::format("move the camera {}, against the arrows of near parts (key r)",
                         move_along(a.shape.parallax.direction));
    case AlignmentGoal::saturated:
      return "expose shorter, or close the camera's iris";
    case AlignmentGoal::light:
      return "expose longer, or open the camera's iris";
  }
  return {};
}

namespace report {

std::string name_of(AlignmentGoal goal) {
  switch (goal) {
    case AlignmentGoal::stripes:
      return "stripes";
    case AlignmentGoal::cells:
      return "cells seen";
    case AlignmentGoal::pixels:
      return "pixels a cell";
    case AlignmentGoal::offset:
      return "offset";
    case AlignmentGoal::focus:
      return "blur";
    case AlignmentGoal::parallax:
      return "parallax";
    case AlignmentGoal::saturated:
      return "saturated";
    case AlignmentGoal::light:
      return "light";
  }
  return {};
}

namespace {

std::string value_of_goal(AlignmentGoal goal, double value) {
  switch (goal) {
    case AlignmentGoal::stripes:
      return value > 0 ? "yes" : "no";
    // Never "100 %" for nearly all cells.
    case AlignmentGoal::cells:
      return fmt::format("{:.2f} %", std::floor(1e4 * value) / 100);
    case AlignmentGoal::saturated:
      return text::percent(value);
    case AlignmentGoal::light:
      return fmt::format("{:.0f}", std::min(value, 1e6));
    default:
      return fmt::format("{:.3f}", value);
  }
}

}  // namespace

std::string value_text(const AlignmentFinding& f) {
  return value_of_goal(f.goal, f.value);
}

std::string wanted_text(const AlignmentFinding& f) {
  switch (f.goal) {
    case AlignmentGoal::stripes:
      return "";
    case AlignmentGoal::cells:
    case AlignmentGoal::pixels:
    case AlignmentGoal::light:
      return ">= " + value_of_goal(f.goal, f.wanted);
    default:
      return "<= " + value_of_goal(f.goal, f.wanted);
  }
}

}  // namespace report
}  // namespace symrig
