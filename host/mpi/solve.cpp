// SPDX-License-Identifier: Apache-2.0
#include "solve.hpp"

#include "petsc.hpp"
#include "symrig/image/file.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace symrig::mpi {
namespace {

double inner(std::span<const float> a, std::span<const float> b) {
  return std::inner_product(a.begin(), a.end(), b.begin(), 0.0, std::plus<>(),
                            [](float x, float y) { return static_cast<double>(x) * static_cast<double>(y); });
}

/// Light below this share of the brightest pixel's cannot be scaled in floats: such a pixel stays dark.
constexpr double kDark = 1e-6;

/// The scaled problem, as TAO sees it, and the best light so far.
class Problem {
 public:
  Problem(const TransportOperator& transport, const Image<float>& wanted, const SolveOptions& options,
          const Progress& progress)
      : transport_(transport),
        wanted_(wanted),
        options_(options),
        progress_(progress),
        norm_(std::sqrt(inner(wanted.values(), wanted.values()))) {}

  /// The scale, bounds and start. Two applications.
  Result<void> begin() {
    SYMRIG_TRY(scale_, adjoint(Image<float>(wanted_.grid(), wanted_.channels(), 1.F)));
    const float brightest = *std::max_element(scale_.values().begin(), scale_.values().end());
    const float least = brightest * static_cast<float>(kDark);
    const float root = std::sqrt(static_cast<float>(wanted_.channels()));
    for (float& d : scale_.values()) d = d > least ? (options_.scaled ? d / root : 1) : 0;
    SYMRIG_TRY(start_, adjoint(wanted_));
    return {};
  }

  std::size_t size() const { return scale_.values().size(); }
  double upper(std::size_t j) const { return static_cast<double>(scale_.values()[j]) * options_.most; }
  double start(std::size_t j) const {
    const double d = scale_.values()[j];
    return d > 0 ? std::clamp(start_.values()[j] / d, 0.0, upper(j)) : 0;
  }

  /// ½ ‖T D⁻¹ q − w‖² / ‖w‖² and its gradient. Two applications.
  Result<double> evaluate(std::span<const double> q, std::span<double> gradient) {
    Image<float> light(scale_.grid());
    for (std::size_t j = 0; j < q.size(); ++j) light.values()[j] = light_at(q[j], j);
    SYMRIG_TRY(Image<float> rest, apply(light));
    for (std::size_t i = 0; i < rest.values().size(); ++i)
      rest.values()[i] = wanted_.values()[i] - rest.values()[i];
    SYMRIG_TRY(const Image<float> back, adjoint(rest));
    const double squares = norm_ * norm_;
    for (std::size_t j = 0; j < q.size(); ++j) {
      const double d = scale_.values()[j];
      gradient[j] = d > 0 ? -static_cast<double>(back.values()[j]) / d / squares : 0;
    }
    const double residual = std::sqrt(inner(rest.values(), rest.values())) / norm_;
    keep(std::move(light), residual, unreachable_share(wanted_, rest, back, options_.most));
    SYMRIG_CHECK(report());
    return residual * residual / 2;
  }

  bool done() const { return found_.residual - found_.unreachable <= options_.tolerance; }
  int evaluations_left() const { return (options_.applications - found_.applications) / 2; }
  Solution solution() const {
    Solution found = found_;
    found.converged = done();
    return found;
  }

  /// TAO cannot carry an Error through.
  std::optional<Error> failure;

 private:
  /// Bounds hold exactly, whatever D⁻¹ D rounds.
  float light_at(double q, std::size_t j) const {
    const double d = scale_.values()[j];
    const auto most = static_cast<float>(options_.most);
    return d > 0 ? std::clamp(static_cast<float>(q / d), 0.F, most) : 0.F;
  }

  void keep(Image<float> light, double residual, double unreachable) {
    found_.unreachable = std::max(found_.unreachable, unreachable);
    if (!found_.light.empty() && residual >= found_.residual) return;
    found_.light = std::move(light);
    found_.residual = residual;
  }

  Result<void> report() const {
    const ProgressEvent so_far{"solving", found_.applications, options_.applications, kNoneToCome};
    if (!progress_ || progress_(so_far)) return {};
    return Error{ErrorCode::interrupted, "stopped before the light was found", "nothing was written"};
  }

  Result<Image<float>> apply(const Image<float>& light) {
    ++found_.applications;
    return transport_.apply(light);
  }
  Result<Image<float>> adjoint(const Image<float>& picture) {
    ++found_.applications;
    return transport_.adjoint(picture);
  }

  const TransportOperator& transport_;
  const Image<float>& wanted_;
  const SolveOptions& options_;
  const Progress& progress_;
  double norm_;
  Image<float> scale_, start_;
  Solution found_;
};

PetscErrorCode evaluate(Tao, Vec q, PetscReal* value, Vec gradient, void* context) {
  auto& problem = *static_cast<Problem*>(context);
  const PetscScalar* from = nullptr;
  PetscScalar* to = nullptr;
  PetscCall(VecGetArrayRead(q, &from));
  PetscCall(VecGetArray(gradient, &to));
  const Result<double> result = problem.evaluate({from, problem.size()}, {to, problem.size()});
  PetscCall(VecRestoreArray(gradient, &to));
  PetscCall(VecRestoreArrayRead(q, &from));
  if (!result) {
    problem.failure = result.error();
    return PETSC_ERR_USER;
  }
  *value = *result;
  return 0;
}

PetscErrorCode stop_if_done(Tao tao, void* context) {
  const auto& problem = *static_cast<const Problem*>(context);
  if (problem.done()) return TaoSetConvergedReason(tao, TAO_CONVERGED_USER);
  if (problem.evaluations_left() < 1) return TaoSetConvergedReason(tao, TAO_DIVERGED_MAXFCN);
  return 0;
}

/// Fills a vector with value(j).
template <class Value>
Result<VecOwner> filled(std::size_t n, const Value& value) {
  SYMRIG_TRY(VecOwner vec, new_vec(static_cast<PetscInt>(n)));
  PetscScalar* to = nullptr;
  SYMRIG_CHECK(checked(VecGetArray(vec.get(), &to), "VecGetArray"));
  for (std::size_t j = 0; j < n; ++j) to[j] = value(j);
  SYMRIG_CHECK(checked(VecRestoreArray(vec.get(), &to), "VecRestoreArray"));
  return vec;
}

PetscErrorCode set_up(Tao tao, Problem& problem, const std::string& method, Vec start, Vec lower, Vec upper) {
  PetscCall(TaoSetType(tao, method.c_str()));
  PetscCall(TaoSetSolution(tao, start));
  PetscCall(TaoSetVariableBounds(tao, lower, upper));
  PetscCall(TaoSetObjectiveAndGradient(tao, nullptr, evaluate, &problem));
  PetscCall(TaoSetConvergenceTest(tao, stop_if_done, &problem));
  PetscCall(TaoSetMaximumFunctionEvaluations(tao, problem.evaluations_left()));
  return 0;
}

Result<void> minimise(Problem& problem, const std::string& method) {
  SYMRIG_CHECK(start_petsc());
  SYMRIG_TRY(const VecOwner q, filled(problem.size(), [&](std::size_t j) { return problem.start(j); }));
  SYMRIG_TRY(const VecOwner lower, new_vec(static_cast<PetscInt>(problem.size())));
  SYMRIG_TRY(const VecOwner upper, filled(problem.size(), [&](std::size_t j) { return problem.upper(j); }));
  Tao made = nullptr;
  SYMRIG_CHECK(checked(TaoCreate(PETSC_COMM_SELF, &made), "TaoCreate"));
  const TaoOwner tao(made);
  SYMRIG_CHECK(checked(set_up(made, problem, method, q.get(), lower.get(), upper.get()), "TaoSetType"));
  const PetscErrorCode code = TaoSolve(made);
  if (problem.failure) return *problem.failure;
  return checked(code, "TaoSolve");
}

Result<void> check(const TransportOperator& transport, const Image<float>& wanted,
                   const SolveOptions& options) {
  if (wanted.grid() != transport.camera_grid() || wanted.channels() != transport.channels())
    return Error{ErrorCode::size_mismatch,
                 fmt::format("the wanted picture is {} with {} channels, the camera {} with {}",
                             to_string(wanted.grid()), wanted.channels(), to_string(transport.camera_grid()),
                             transport.channels()),
                 "give a picture of the size of the scene's photographs"};
  SYMRIG_CHECK(check_finite(wanted, "the wanted picture"));
  if (std::all_of(wanted.values().begin(), wanted.values().end(), [](float v) { return v <= 0; }))
    return Error{ErrorCode::bad_value, "the wanted picture is dark everywhere, so its light is 0",
                 "give a picture in radiance per unit of projector light"};
  constexpr double kMostLight = 1e6;  // far beyond any projector, and far from where floats end
  if (!(options.most > 0 && options.most <= kMostLight))
    return Error{ErrorCode::bad_argument,
                 fmt::format("the largest light {} is not between 0 and {:g}", options.most, kMostLight),
                 "1 is full light"};
  if (!(options.tolerance > 0 && options.tolerance < 1))
    return Error{ErrorCode::bad_argument,
                 fmt::format("the tolerance {} is not between 0 and 1", options.tolerance),
                 "0.001 is one part in a thousand of the wanted picture"};
  if (options.applications < 4)
    return Error{ErrorCode::bad_argument, fmt::format("{} applications are too few", options.applications),
                 "the first light takes 4"};
  return {};
}

}  // namespace

double unreachable_share(const Image<float>& wanted, const Image<float>& rest,
                         const Image<float>& adjoint_of_rest, double most) {
  const double length = std::sqrt(inner(rest.values(), rest.values()));
  if (length == 0) return 0;
  double farthest = 0;
  for (const float v : adjoint_of_rest.values()) farthest += std::max(0.0, static_cast<double>(v));
  const double beyond = (inner(rest.values(), wanted.values()) - most * farthest) / length;
  return std::max(0.0, beyond / std::sqrt(inner(wanted.values(), wanted.values())));
}

Result<Solution> solve(const TransportOperator& transport, const Image<float>& wanted,
                       const SolveOptions& options, const Progress& progress) {
  SYMRIG_CHECK(check(transport, wanted, options));
  Problem problem(transport, wanted, options, progress);
  SYMRIG_CHECK(problem.begin());
  SYMRIG_CHECK(minimise(problem, options.method));
  return problem.solution();
}

}  // namespace symrig::mpi
