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

# start_board: symrigd behind the USB gadget. It does not measure its lateness: a board that starts anew in the middle of a
# capture would take what bench_scene does above its priority for the machine's own. Words that are later are counted.
start_board() {
  mkdir -p /run/symrig /var/lib/symrig
  printf '[link]\nusb = "%s"\n[realtime]\nlateness_us = 50\n' "$BENCH_FFS" >/run/symrig/board.toml
  "$SYMRIGD" --config /run/symrig/board.toml >>"$BENCH_OUT/board.log" 2>&1 &
  board=$!
  until_line "$BENCH_OUT/board.log" serves "$board"
  bench-usb plug || fail "the board does not enumerate: $(cat "$BENCH_OUT/board.log")"
}

truth=/run/truth.jsonl # what truly happened, by bench_scene; stop_scene copies it to $BENCH_OUT

# start_scene ARGUMENTS...: as bench_scene, on the screen that write_rig describes.
start_scene() {
  "$BENCH_SCENE" "$@" --cell 7 --top 3 --left 5 --log $truth >"$BENCH_OUT/scene.log" 2>&1 &
  scene=$!
  until_line "$BENCH_OUT/scene.log" ready "$scene"
}

# stop_scene: ends it and shows what it has counted; fails if it was not able to tell the truth.
stop_scene() {
  kill "$scene" 2>/dev/null
  wait "$scene" || fail "bench_scene: $(tail -n 1 "$BENCH_OUT/scene.log")"
  cp $truth "$BENCH_OUT/"
  grep '^bench_scene:' "$BENCH_OUT/scene.log"
}

stop_board() {
  kill "$board" 2>/dev/null
  wait "$board"
}

# write_rig ROWSxCOLS [SED-COMMAND...]: rig.toml of the bench, in $rig.
write_rig() {
  local rows=${1%x*} cols=${1#*x} edits=()
  shift
  for edit in "$@"; do edits+=(-e "$edit"); done
  rig=$BENCH_OUT/rig.toml
  sed -e "s/@ROWS@/$rows/g" -e "s/@COLS@/$cols/g" "${edits[@]}" "$here/rig.toml.in" >"$rig"
}

exposures() { grep -c '^{"exposed"' $truth; }

# after_exposures COUNT PID: waits until the camera has exposed so often, as long as the process lives.
after_exposures() {
  while [ "$(exposures)" -lt "$1" ]; do
    kill -0 "$2" 2>/dev/null || fail "ended after $(exposures) exposures, before the $1 that were waited for"
    sleep 0.1
  done
}
