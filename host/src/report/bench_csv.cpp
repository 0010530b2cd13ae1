// SPDX-License-Identifier: Apache-2.0
#include "symrig/report/bench.hpp"

#include <cmath>
#include <string_view>

#include <fmt/format.h>

namespace symrig {
namespace {

constexpr std::string_view kNames =
    "scene,rows,cols,channels,noise,seed,algorithm,tolerance,preset,patterns,frames,rig_seconds,host_seconds,"
    "process_seconds,merge_seconds,simulate_seconds,wall_seconds,tensor_bytes,frobenius,indirect,flood,"
    "relight_bar,relight_random,relight_natural,bar_indirect,failure,profile,light_seconds,camera_seconds,"
    "projector_seconds\n";

/// The shortest text that is read back as the same number; empty for NaN and infinity.
std::string number(double value) {
  return std::isfinite(value) ? fmt::format("{}", value) : std::string();
}

std::string csv_text(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

std::string joined(const std::vector<std::string>& fields) {
  std::string line;
  for (const std::string& field : fields) line += (line.empty() ? "" : ",") + field;
  return line;
}

std::string measured(const BenchCapture& c) {
  if (!c.done()) return std::string(15, ',');  // sixteen empty fields
  const TransportErrors& e = c.error;
  std::vector<std::string> fields{std::to_string(c.patterns), std::to_string(c.frames)};
  for (const double seconds : {c.rig_seconds, c.host_seconds(), c.process_seconds, c.merge_seconds,
                               c.simulate_seconds, c.wall_seconds})
    fields.push_back(number(seconds));
  fields.push_back(std::to_string(c.tensor_bytes));
  for (const double error :
       {e.frobenius, e.indirect, e.flood, e.relight_bar, e.relight_random, e.relight_natural, e.bar_indirect})
    fields.push_back(number(error));
  return joined(fields);
}

/// The parts of the rig's time.
std::string parts_of(const BenchCapture& c) {
  if (!c.done()) return ",,";
  return joined({number(c.rig_time.light), number(c.rig_time.camera), number(c.rig_time.projector)});
}

std::string line(const BenchPlan& plan, const BenchCapture& c) {
  const std::string tolerance = c.what.tolerance ? number(*c.what.tolerance) : std::string();
  return fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{}\n", csv_text(c.what.scene), c.what.grid.rows,
                     c.what.grid.cols, plan.channels, plan.camera_noise ? "camera" : "off", c.what.seed,
                     name(c.what.algorithm), tolerance, c.what.preset ? 1 : 0, measured(c),
                     csv_text(c.failure), c.what.profile, parts_of(c));
}

}  // namespace

std::string bench_csv(const BenchRun& run) {
  std::string text(kNames);
  for (const BenchCapture& capture : run.captures) text += line(run.plan, capture);
  return text;
}

}  // namespace symrig
