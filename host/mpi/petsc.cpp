// SPDX-License-Identifier: Apache-2.0
#include "petsc.hpp"

#include <fmt/format.h>

namespace symrig::mpi {

Result<void> start_petsc() {
  PetscBool started = PETSC_FALSE;
  SYMRIG_CHECK(checked(PetscInitialized(&started), "PetscInitialized"));
  if (started == PETSC_TRUE) return {};
  PETSC_COMM_WORLD = MPI_COMM_SELF;
  SYMRIG_CHECK(checked(PetscOptionsSetValue(nullptr, "-no_signal_handler", "1"), "PetscOptionsSetValue"));
  SYMRIG_CHECK(checked(PetscOptionsSetValue(nullptr, "-skip_petscrc", "1"), "PetscOptionsSetValue"));
  SYMRIG_CHECK(checked(PetscInitializeNoArguments(), "PetscInitialize"));
  return checked(PetscPushErrorHandler(PetscReturnErrorHandler, nullptr), "PetscPushErrorHandler");
}

void end_petsc() {
  PetscBool started = PETSC_FALSE;
  if (PetscInitialized(&started) == 0 && started == PETSC_TRUE) static_cast<void>(PetscFinalize());
}

Result<void> checked(PetscErrorCode code, const char* call) {
  if (code == 0) return {};
  return Error{ErrorCode::fault, fmt::format("{} of PETSc failed with code {}", call, static_cast<int>(code)),
               "report this with the scene and the command"};
}

Result<VecOwner> new_vec(PetscInt n) {
  Vec vec = nullptr;
  SYMRIG_CHECK(checked(VecCreateSeq(PETSC_COMM_SELF, n, &vec), "VecCreateSeq"));
  return VecOwner(vec);
}

}  // namespace symrig::mpi
