// SPDX-License-Identifier: Apache-2.0
// Captures a simulated scene, relights it by a bar of light, and compares with the scene's own answer.
#include "symrig/acquisition/capture.hpp"
#include "symrig/acquisition/evaluate.hpp"
#include "symrig/sim/virtual_rig.hpp"

#include <cmath>
#include <iostream>

namespace {

double norm(const symrig::Image<float>& image) {
  double sum = 0;
  for (const float value : image.values()) sum += double{value} * value;
  return std::sqrt(sum);
}

symrig::Image<float> difference(symrig::Image<float> a, const symrig::Image<float>& b) {
  for (std::size_t i = 0; i < a.values().size(); ++i) a.values()[i] -= b.values()[i];
  return a;
}

int explain(const symrig::Error& error) {
  std::cerr << error.line() << '\n';
  return symrig::exit_code(error.code);
}

}  // namespace

int main() {
  auto rig = symrig::open_virtual_rig("sim:vgroove-textured?size=24x32&noise=off");
  if (!rig) return explain(rig.error());

  auto captured = symrig::capture(**rig, {});
  if (!captured) return explain(captured.error());

  const symrig::Pattern bar = symrig::bar_pattern((*rig)->grid());
  auto relit = captured->tensor.apply(bar);
  if (!relit) return explain(relit.error());

  const symrig::Image<float> truth = (*rig)->truth().apply(bar);
  const double error = norm(difference(*relit, truth)) / norm(truth);
  std::cout << captured->patterns << " patterns, relative error of the relit picture " << error << '\n';

  // Every leaf was accepted at a misfit of at most 2 % of its own signal (RankRule::signal_fraction); the bar
  // is a sum over leaves, so their misfits cannot add up to much more than that share of the picture.
  return error < 0.05 ? 0 : 1;
}
