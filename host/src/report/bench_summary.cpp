// SPDX-License-Identifier: Apache-2.0

#include "symrig/report/bench.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace symrig {

namespace {

bool usable(const CostError& p) {
  return std::isfinite(p.cost) && p.cost > 0 && std::isfinite(p.error) && p.error >= 0;
}

/// y at x by linear interpolation of log y over log x through two points. x0 ≠ x1; all > 0.
double on_log_line(double x, double x0, double y0, double x1, double y1) {
  const double share = std::log(x / x0) / std::log(x1 / x0);
  return y0 * std::pow(y1 / y0, share);
}

}  // namespace

std::vector<CostError> lower_envelope(std::vector<CostError> captures) {
  std::erase_if(captures, [](const CostError& p) { return !usable(p); });
  std::sort(captures.begin(), captures.end(), [](const CostError& a, const CostError& b) {
    return a.cost < b.cost || (a.cost == b.cost && a.error < b.error);
  });
  std::vector<CostError> envelope;
  for (const CostError& p : captures)
    if (envelope.empty() || p.error < envelope.back().error) envelope.push_back(p);
  return envelope;
}

CurveReading cost_at_error(std::span<const CostError> envelope, double error) {
  if (envelope.empty() || !(error >= envelope.back().error)) return {};
  if (error > envelope.front().error) return {Reach::at_most, envelope.front().cost};
  const auto hit = std::find_if(envelope.begin(), envelope.end(),
                                [error](const CostError& p) { return p.error <= error; });
  if (hit->error == error) return {Reach::read, hit->cost};
  if (hit->error == 0) return {Reach::at_most, hit->cost};
  const CostError& before = *std::prev(hit);
  return {Reach::read, on_log_line(error, before.error, before.cost, hit->error, hit->cost)};
}

CurveReading error_at_cost(std::span<const CostError> envelope, double cost) {
  if (envelope.empty() || !(cost >= envelope.front().cost)) return {};
  if (cost > envelope.back().cost) return {Reach::at_most, envelope.back().error};
  const auto hit =
      std::find_if(envelope.begin(), envelope.end(), [cost](const CostError& p) { return p.cost >= cost; });
  if (hit->cost == cost) return {Reach::read, hit->error};
  const CostError& before = *std::prev(hit);
  if (hit->error == 0) return {Reach::at_most, before.error};
  return {Reach::read, on_log_line(cost, before.cost, before.error, hit->cost, hit->error)};
}

CurveReading ratio(const CurveReading& value, double reference) {
  if (!value.reached()) return {};
  if (reference > 0) return {value.reach, value.value / reference};
  return value.value == 0 ? CurveReading{value.reach, 1} : CurveReading{};
}

CurveReading larger(const CurveReading& a, const CurveReading& b) {
  if (!a.reached() || !b.reached()) return {};
  if (a.value != b.value) return a.value > b.value ? a : b;
  return a.reach == Reach::read ? a : b;
}

Reach MeanRatio::reach() const {
  if (averaged == 0 || not_reached > 0) return Reach::not_reached;
  return bounds > 0 || zero > 0 ? Reach::at_most : Reach::read;
}

MeanRatio geometric_mean(std::span<const CurveReading> ratios) {
  MeanRatio mean;
  double logs = 0;
  for (const CurveReading& one : ratios) {
    if (!one.reached()) {
      ++mean.not_reached;
    } else if (one.value <= 0) {
      ++mean.zero;
    } else {
      ++mean.averaged;
      mean.bounds += one.reach == Reach::at_most ? 1 : 0;
      logs += std::log(one.value);
    }
  }
  if (mean.averaged > 0) mean.value = std::exp(logs / mean.averaged);
  return mean;
}

namespace {

/// The captures of one scene, size and seed by one algorithm.
std::vector<BenchCapture> captures_of(const BenchRun& run, const BenchCase& like, Algorithm algorithm) {
  std::vector<BenchCapture> found;
  for (const BenchCapture& one : run.captures)
    if (one.done() && one.what.scene == like.scene && one.what.grid == like.grid &&
        one.what.seed == like.seed && one.what.profile == like.profile && one.what.algorithm == algorithm)
      found.push_back(one);
  return found;
}

std::vector<CostError> envelope_of(const std::vector<BenchCapture>& captures,
                                   double TransportErrors::*metric) {
  std::vector<CostError> points;
  points.reserve(captures.size());
  for (const BenchCapture& one : captures)
    points.push_back({static_cast<double>(one.patterns), one.error.*metric});
  return lower_envelope(std::move(points));
}

BenchPair compare(const BenchCapture& paper, const std::vector<BenchCapture>& symrig) {
  BenchPair pair;
  pair.scene = paper.what.scene;
  pair.seed = paper.what.seed;
  pair.paper_patterns = static_cast<double>(paper.patterns);
  pair.paper_error = paper.error;
  const auto patterns_at = [&](double TransportErrors::*metric) {
    return ratio(cost_at_error(envelope_of(symrig, metric), paper.error.*metric), pair.paper_patterns);
  };
  const auto error_at = [&](double TransportErrors::*metric) {
    return ratio(error_at_cost(envelope_of(symrig, metric), pair.paper_patterns), paper.error.*metric);
  };
  pair.patterns_at_indirect = patterns_at(&TransportErrors::indirect);
  pair.patterns_at_bar_indirect = patterns_at(&TransportErrors::bar_indirect);
  pair.patterns_at_both = larger(pair.patterns_at_indirect, pair.patterns_at_bar_indirect);
  pair.indirect_at_patterns = error_at(&TransportErrors::indirect);
  pair.frobenius_at_patterns = error_at(&TransportErrors::frobenius);
  return pair;
}

void add_pair(const BenchRun& run, const BenchCase& like, BenchSummary& summary) {
  const std::vector<BenchCapture> paper = captures_of(run, like, Algorithm::paper);
  const std::vector<BenchCapture> symrig = captures_of(run, like, Algorithm::symrig);
  const auto reference =
      std::find_if(paper.begin(), paper.end(), [](const BenchCapture& one) { return one.what.preset; });
  if (reference != paper.end() && !symrig.empty()) summary.pairs.push_back(compare(*reference, symrig));
}

double flood_bias(const TransportErrors& error) {
  return error.frobenius > 0 ? error.flood / error.frobenius : 0;
}

void add_flood(const BenchRun& run, const std::string& scene, Algorithm algorithm, BenchSummary& summary) {
  FloodBias bias{.scene = scene, .algorithm = algorithm};
  bool any = false;
  for (const BenchCapture& one : run.captures) {
    const bool counts = one.done() && one.what.scene == scene && one.what.grid == summary.grid &&
                        one.what.profile == summary.profile && one.what.algorithm == algorithm;
    if (!counts) continue;
    any = true;
    bias.worst = std::max(bias.worst, flood_bias(one.error));
    if (one.what.preset) bias.at_preset = std::max(bias.at_preset, flood_bias(one.error));
  }
  if (any) summary.flood.push_back(bias);
}

void add_means(BenchSummary& summary) {
  summary.patterns_at_indirect = mean_of(summary.pairs, &BenchPair::patterns_at_indirect);
  summary.patterns_at_bar_indirect = mean_of(summary.pairs, &BenchPair::patterns_at_bar_indirect);
  summary.patterns_at_both = mean_of(summary.pairs, &BenchPair::patterns_at_both);
  summary.indirect_at_patterns = mean_of(summary.pairs, &BenchPair::indirect_at_patterns);
  summary.frobenius_at_patterns = mean_of(summary.pairs, &BenchPair::frobenius_at_patterns);
}

BenchSummary summary_of(const BenchRun& run, const std::string& profile, Grid size) {
  BenchSummary summary;
  summary.grid = size;
  summary.profile = profile;
  for (const std::string& scene : run.plan.scenes) {
    for (const int seed : run.plan.seeds)
      add_pair(run, {.scene = scene, .grid = size, .seed = seed, .profile = profile}, summary);
    for (const BenchSweep& sweep : run.plan.sweeps) add_flood(run, scene, sweep.algorithm, summary);
  }
  add_means(summary);
  return summary;
}

}  // namespace

std::vector<BenchSummary> summarize(const BenchRun& run) {
  std::vector<BenchSummary> all;
  all.reserve(run.plan.profiles.size() * run.plan.sizes.size());
  for (const std::string& profile : run.plan.profiles)
    for (const Grid size : run.plan.sizes) all.push_back(summary_of(run, profile, size));
  return all;
}

std::vector<BenchPair> pairs_of(const BenchSummary& summary, const std::string& scene) {
  std::vector<BenchPair> found;
  std::copy_if(summary.pairs.begin(), summary.pairs.end(), std::back_inserter(found),
               [&scene](const BenchPair& pair) { return pair.scene == scene; });
  return found;
}

MeanRatio mean_of(const std::vector<BenchPair>& pairs, CurveReading BenchPair::*reading) {
  std::vector<CurveReading> readings;
  readings.reserve(pairs.size());
  for (const BenchPair& pair : pairs) readings.push_back(pair.*reading);
  return geometric_mean(readings);
}

}  // namespace symrig
