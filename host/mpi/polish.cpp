// SPDX-License-Identifier: Apache-2.0
#include "polish.hpp"

#include "acquisition/errors/checks.hpp"
#include "acquisition/refine/polish.hpp"
#include "acquisition/search/finishing.hpp"
#include "acquisition/tree/node.hpp"
#include "acquisition/tree/photographer.hpp"
#include "polish_parts.hpp"
#include "ranks.hpp"
#include "symrig/report/internal/json_text.hpp"
#include "symrig/report/summary.hpp"

#include <algorithm>
#include <memory>
#include <set>
#include <utility>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace symrig::mpi {
namespace {

using acquisition::Checks;
using acquisition::FloodLit;
using acquisition::KnownTransport;
using acquisition::Photographer;
using acquisition::Polish;
using report::Json;

/// What every rank reads before the polish begins.
struct Opened {
  StoredScene scene;  ///< its leaves stay in the file
  CapturePhotographs photographs;
  double tolerance = 0;
  GainMismatch gain;
};

Result<double> tolerance_of(const report::CaptureFacts& facts, const std::string& path) {
  const auto tolerance = facts.number("/tolerance_coarsest");
  if (tolerance && *tolerance > 0) return *tolerance;
  return Error{ErrorCode::bad_value, fmt::format("{} does not state the tolerance of its search", path),
               "polish captures of the algorithm symrig"};
}

/// A mismatch that was found is part of the errors.
Result<GainMismatch> gain_of(const report::CaptureFacts& facts, const std::string& path) {
  GainMismatch gain;
  const nlohmann::json* const found = facts.find("/gain_mismatch/found");
  if (found == nullptr || !found->is_boolean() || !found->get<bool>()) return gain;
  gain.found = true;
  gain.rms = facts.number("/gain_mismatch/rms").value_or(0);
  gain.sigma = facts.number("/gain_mismatch/sigma").value_or(0);
  const std::vector<double> shape = facts.numbers("/gain_mismatch/shape");
  if (shape.size() != gain.shape.size() || !(gain.rms > 0))
    return Error{ErrorCode::bad_value,
                 fmt::format("{} found a mismatch of gains and does not state its shape, so errors cannot be "
                             "estimated",
                             path),
                 "capture again with this version"};
  std::copy(shape.begin(), shape.end(), gain.shape.begin());
  return gain;
}

Result<Opened> open_files(const PolishJob& job) {
  Opened opened;
  SYMRIG_TRY(opened.scene, load_scene(job.scene, {.memory = 1}));
  const report::CaptureFacts facts(opened.scene.capture_json);
  SYMRIG_TRY(opened.tolerance, tolerance_of(facts, job.scene));
  SYMRIG_TRY(opened.gain, gain_of(facts, job.scene));
  SYMRIG_TRY(opened.photographs, open_photographs(job.log, opened.scene, job.scene));
  return opened;
}

Result<void> check_same(const Ranks& ranks, const PolishJob& job, const Opened& opened) {
  const auto photographs = static_cast<std::uint64_t>(opened.photographs.log->size());
  const std::vector<std::uint64_t> scenes = ranks.gather(identity_of(opened.scene));
  const std::vector<std::uint64_t> logs = ranks.gather(photographs);
  Result<void> same;
  if (std::set(scenes.begin(), scenes.end()).size() > 1 || std::set(logs.begin(), logs.end()).size() > 1)
    same = Error{ErrorCode::bad_value,
                 fmt::format("{}: the machines have different scenes or logs under this name", job.scene),
                 "give a path on a file system that they share, or copy the files again"};
  return ranks.all(same);
}

/// The mean square that T may miss in a sample, of each channel.
std::vector<double> least_misfit(const FloodLit& flood, double tolerance) {
  std::vector<double> misfit;
  for (const double f : flood.squared) misfit.push_back(tolerance * tolerance * f);
  return misfit;
}

/// The polish of this rank's parts.
Result<Polished> refit(const RankTeam& team, std::span<KnownTransport> parts, const Opened& opened,
                       const Photographer& photographer, int steps) {
  const Grid grid = opened.scene.tensor.camera_grid();
  const Result<FloodLit> flood = FloodLit::read(photographer, opened.scene.tensor.channels());
  SYMRIG_CHECK(team.all(flood ? Result<void>() : Result<void>(flood.error())));
  Polish polish(team, parts, photographer,
                {static_cast<std::size_t>(grid.size()), opened.photographs.used,
                 least_misfit(*flood, opened.tolerance)});
  Polished polished;
  for (const acquisition::LogRange& range : opened.photographs.used)
    polished.photographs += range.last - range.first;
  for (bool better = true; better && polished.steps < steps; ++polished.steps) {
    SYMRIG_TRY(const Polish::Outcome outcome, polish.step(acquisition::kConjugateSteps));
    if (polished.steps == 0) polished.before = outcome.before;
    polished.after = outcome.after;
    better = outcome.after < outcome.before;
  }
  return polished;
}

/// T with the numbers of all ranks; empty on all but the first.
TransportTensor gather(const Ranks& ranks, const PolishParts& parts, std::span<const KnownTransport> mine,
                       const TransportTensor& whole) {
  PolishParts::Assembly assembly(parts, whole);
  for (std::size_t part = 0; part < parts.count(); ++part) {
    const int from = parts.rank_of(part);
    std::vector<float> numbers;
    if (from == ranks.rank()) numbers = parts.numbers(mine[part - parts.of_rank(from).begin]);
    if (from != ranks.rank() && ranks.first()) numbers.resize(parts.number_count(whole, part));
    ranks.hand_to_first(numbers, from);
    if (ranks.first()) assembly.add(part, numbers);
  }
  return ranks.first() ? std::move(assembly).finish() : TransportTensor();
}

void state_errors(const CaptureResult& result, Json& facts) {
  Json errors = Json::parse(rig_errors_json("", *result.estimated, result.estimated_half_width, nullptr));
  facts["estimated_error"] = errors["error"];
  facts["estimated_error_uncertainty"] = errors["error_uncertainty"];
  Json not_given = Json::object();
  for (const ErrorNotGiven& one : result.estimate_not_given) not_given[one.key] = one.reason;
  facts["estimated_error_not_given"] = not_given;
}

/// On the first rank: the errors of the new T, by the photographs that it was not refitted to.
Result<void> estimate(const Opened& opened, const Photographer& photographer, Polished& polished) {
  const CapturePhotographs& photographs = opened.photographs;
  SYMRIG_TRY(const Checks checks, Checks::of_log(photographer, photographs.held_out, photographs.further));
  CaptureResult result;
  result.gain_mismatch = opened.gain;
  SYMRIG_CHECK(acquisition::estimate_finished(polished.scene.tensor, photographer, checks,
                                              photographs.flood_lit, nullptr, result));
  Json facts = Json::parse(opened.scene.capture_json);
  state_errors(result, facts);
  facts["polish"] = {{"steps", polished.steps},
                     {"parts", polished.parts},
                     {"misfit", {{"before", polished.before}, {"after", polished.after}}}};
  polished.scene.capture_json = report::json_text(facts);
  polished.errors = {*result.estimated, result.estimated_half_width, result.estimate_not_given};
  return {};
}

/// On every rank, with the same job.
Result<Polished> polish_here(const Ranks& ranks, const PolishJob& job, const Progress& progress) {
  Result<Opened> opened = open_files(job);
  SYMRIG_CHECK(ranks.all(opened ? Result<void>() : Result<void>(opened.error())));
  SYMRIG_CHECK(check_same(ranks, job, *opened));
  const TransportTensor& whole = opened->scene.tensor;
  SYMRIG_TRY(const PolishParts parts, PolishParts::of(whole, ranks.count(), job.parts));
  Result<std::vector<KnownTransport>> mine = parts.read(whole, ranks.rank());
  SYMRIG_CHECK(ranks.all(mine ? Result<void>() : Result<void>(mine.error())));
  const RankTeam team(ranks, parts, progress);
  EndedRig rig(*opened->photographs.log);
  const Photographer photographer(rig, opened->photographs.log.get(), whole.camera_tree(), {});
  SYMRIG_TRY(Polished polished, refit(team, *mine, *opened, photographer, job.steps));
  polished.parts = job.parts;
  polished.scene.tensor = gather(ranks, parts, *mine, whole);
  if (ranks.first()) {
    polished.scene.held_out = opened->scene.held_out;
    SYMRIG_CHECK(estimate(*opened, photographer, polished));
  }
  return polished;
}

Result<void> check(const Ranks& ranks, const PolishJob& job) {
  constexpr int kMostSteps = 20;  // as of a capture
  constexpr int kMostParts = 1000;
  if (job.steps < 1 || job.steps > kMostSteps)
    return Error{ErrorCode::bad_argument, fmt::format("{} is not a number of steps", job.steps),
                 fmt::format("give 1 to {}", kMostSteps)};
  if (job.parts < ranks.count() || job.parts > kMostParts)
    return Error{ErrorCode::bad_argument,
                 fmt::format("{} parts cannot be dealt to {} ranks", job.parts, ranks.count()),
                 fmt::format("give one part a rank or more, at most {}", kMostParts)};
  return {};
}

/// To all ranks.
void hand_out(const Ranks& ranks, PolishJob& job) {
  ranks.broadcast_text(job.scene);
  ranks.broadcast_text(job.log);
  ranks.broadcast_value(job.steps);
  ranks.broadcast_value(job.parts);
}

}  // namespace

Result<void> RankTeam::all(const Result<void>& mine) const {
  Result<void> told = mine;
  if (told && progress_ && !progress_({"polish", ++exchanges_, 0, {}}))
    told = Error{ErrorCode::interrupted, "stopped before the polish was done", "nothing was written"};
  return ranks_.all(told);
}

Result<Polished> polish(const Ranks& ranks, const PolishJob& job, const Progress& progress) {
  PolishJob sent = job;
  if (sent.parts == 0) sent.parts = ranks.count();
  SYMRIG_CHECK(check(ranks, sent));
  Together polishing(ranks, {Request::refit});
  hand_out(ranks, sent);
  Result<Polished> polished = polish_here(ranks, sent, progress);
  polishing.done();
  return polished;
}

void help_polish(const Ranks& ranks) {
  PolishJob job;
  hand_out(ranks, job);
  static_cast<void>(polish_here(ranks, job, {}));  // the first rank reports what failed
}

}  // namespace symrig::mpi
