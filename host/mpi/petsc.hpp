// SPDX-License-Identifier: Apache-2.0
// PETSc in one process: errors as Result, objects that free themselves.
#pragma once

#include "symrig/base/result.hpp"

#include <memory>
#include <string>

#include <petsctao.h>

namespace symrig::mpi {

static_assert(sizeof(PetscScalar) == sizeof(double), "symrig-mpi needs PETSc with real numbers in doubles");

/// Starts PETSc on this process alone, at the first call. MPI must run. It reads no options of the user, and
/// leaves signals alone. It starts only once in a process: PETSc 3.18 finds no solver of TAO when it starts
/// again.
Result<void> start_petsc();
/// Before MPI ends; does nothing if PETSc has not started.
void end_petsc();

/// A failure inside PETSc, which is a fault of ours.
Result<void> checked(PetscErrorCode code, const char* call);

struct DestroyVec {
  void operator()(Vec vec) const { VecDestroy(&vec); }
};
struct DestroyTao {
  void operator()(Tao tao) const { TaoDestroy(&tao); }
};
using VecOwner = std::unique_ptr<_p_Vec, DestroyVec>;
using TaoOwner = std::unique_ptr<_p_Tao, DestroyTao>;

/// A vector of n zeros.
Result<VecOwner> new_vec(PetscInt n);

}  // namespace symrig::mpi
