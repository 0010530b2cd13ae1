# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
# What jobs share: a whole rig in the guest. Sourced, after the programs were named:
#   SYMRIG SYMRIGD BENCH_SCENE BENCH_AUDIT   programs of the build
# Everything a job leaves lies in $BENCH_OUT.
set -u -o pipefail
: "${SYMRIG:?}" "${SYMRIGD:?}" "${BENCH_SCENE:?}" "${BENCH_AUDIT:?}" "${BENCH_OUT:?runs in the guest only}"
here=$(dirname "${BASH_SOURCE[0]}")

fail() {
  echo "job: $*" >&2
  exit 1
}

# until_line FILE PATTERN PID: waits for a line, as long as the process that shall write it lives.
until_line() {
  until grep -q "$2" "$1" 2>/dev/null; do
    kill -0 "$3" 2>/dev/null || fail "ended before it said '$2': $(cat "$1")"
    sleep 0.02
  done
}

# start_board: symrigd behind the USB gadget.
start_board() {
  mkdir -p /run/symrig /var/lib/symrig
  printf '[link]\nusb = "%s"\n' "$BENCH_FFS" >/run/symrig/board.toml
  "$SYMRIGD" --config /run/symrig/board.toml >>"$BENCH_OUT/board.log" 2>&1 &
  board=$!
  until_line "$BENCH_OUT/board.log" serves "$board"
  bench-usb plug || fail "the board does not enumerate: $(cat "$BENCH_OUT/board.log")"
}

# start_scene ARGUMENTS...: as bench_scene; its log is truth.jsonl.
start_scene() {
  "$BENCH_SCENE" "$@" --log "$BENCH_OUT/truth.jsonl" >"$BENCH_OUT/scene.log" 2>&1 &
  scene=$!
  until_line "$BENCH_OUT/scene.log" ready "$scene"
}

# stop_scene: ends it and shows what it has counted; fails if it was not able to tell the truth.
stop_scene() {
  kill "$scene" 2>/dev/null
  wait "$scene" || fail "bench_scene: $(tail -n 1 "$BENCH_OUT/scene.log")"
  grep '^bench_scene:' "$BENCH_OUT/scene.log"
}

stop_board() {
  kill "$board" 2>/dev/null
  wait "$board"
}

# write_rig ROWS COLS CELL: rig.toml of the bench, in $rig. Patterns lie in a corner of a 640x480 screen.
write_rig() {
  rig=$BENCH_OUT/rig.toml
  sed -e "s/@ROWS@/$1/g" -e "s/@COLS@/$2/g" -e "s/@CELL@/$3/g" "$here/rig.toml.in" >"$rig"
}

# numbers FILE KEY...: values of a JSON file, dots for levels.
numbers() { python3 "$here/numbers.py" "$@"; }
