# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
# Shared by tools/setup, tools/demo and tools/test: where things are, and how to speak to the person who waits.
# Source it: `. "$(dirname "$0")/lib.sh"`.

set -euo pipefail
export LC_ALL=C.UTF-8

ROOT=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
LOGS=$ROOT/out/logs
JOBS=${SYMRIG_JOBS:-$(nproc)}
mkdir -p "$LOGS"

# say "text": a step that begins.  note "text": a detail of it.
say() { printf '\n==> %s\n' "$*"; }
note() { printf '    %s\n' "$*"; }

# die "what went wrong; what to do": one line, and out.
die() {
  printf '%s: %s\n' "${0##*/}" "$*" >&2
  exit 1
}

# logged NAME COMMAND...: runs it with its output in out/logs/NAME.log; shows the end of that only if it fails.
logged() {
  local name=$1 log=$LOGS/$1.log
  shift
  if "$@" >"$log" 2>&1 </dev/null; then return 0; fi
  printf '%s: %s failed:\n' "${0##*/}" "$name" >&2
  tail -n 40 "$log" >&2
  printf '%s: the whole output is in %s\n' "${0##*/}" "${log#"$ROOT"/}" >&2
  return 1
}

# build DIR TARGET...: Ninja with its progress line on a terminal, silent but for errors in a pipe.
build() {
  local dir=$1 quiet=()
  shift
  [ -t 1 ] || quiet=(--quiet)
  ninja -C "$dir" -j "$JOBS" "${quiet[@]}" "$@"
}
