# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
# Shared by jobs: a complete rig in the guest. Source it after setting these variables:
#   SYMRIG SYMRIGD BENCH_SCENE BENCH_AUDIT   programs of the build
# A job writes all its files to $BENCH_OUT.
set -u -o pipefail
: "${SYMRIG:?}" "${SYMRIGD:?}" "${BENCH_SCENE:?}" "${BENCH_AUDIT:?}" "${BENCH_OUT:?runs in the guest only}"
here=$(dirname "${BASH_SOURCE[0]}")

fail() {
  echo "job: $*" >&2
  exit 1
}

# until_line FILE PATTERN PID: waits for a line while the process that writes it lives.
until_line() {
  until grep -q "$2" "$1" 2>/dev/null; do
    kill -0 "$3" 2>/dev/null || fail "ended before it said '$2': $(cat "$1")"
    sleep 0.02
  done
}

# start_board: symrigd as a USB gadget. It does not measure its lateness, but promises this one. A board that restarts during a
# capture would measure the load of bench_scene, which has a higher priority. Late words are counted.
lateness_us=50
start_board() {
  mkdir -p /run/symrig /var/lib/symrig
  printf '[link]\nusb = "%s"\n[realtime]\nlateness_us = %s\n' "$BENCH_FFS" $lateness_us >/run/symrig/board.toml
  "$SYMRIGD" --config /run/symrig/board.toml >>"$BENCH_OUT/board.log" 2>&1 &
  board=$!
  until_line "$BENCH_OUT/board.log" serves "$board"
  bench-usb plug || fail "the board does not enumerate: $(cat "$BENCH_OUT/board.log")"
}

truth=/run/truth.jsonl # the log of bench_scene; stop_scene copies it to $BENCH_OUT. A job may name another one.

# The screen of bench_scene and of write_rig: its mode, screen pixels along the side of a cell, and the first cell's place.
mode=640x480 cell=7 top=3 left=5

# start_scene ARGUMENTS...: runs bench_scene with them.
start_scene() {
  : >"$BENCH_OUT/scene.log" # a scene before it was ready, too
  "$BENCH_SCENE" "$@" --cell "$cell" --top "$top" --left "$left" --log $truth >"$BENCH_OUT/scene.log" 2>&1 &
  scene=$!
  until_line "$BENCH_OUT/scene.log" ready "$scene"
}

# plug_in_usbip FILE-PATTERN: plugs in the device of bench_scene on USB/IP, and waits until the kernel has the files of its driver.
plug_in_usbip() {
  usbip attach -r 127.0.0.1 -b 1-1 || fail "the device on USB/IP cannot be plugged in"
  until compgen -G "$1" >/dev/null; do sleep 0.02; done
}

# stop_scene: ends it and shows its counts. Fails if its log is incomplete.
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

# write_rig ROWSxCOLS [SED-COMMAND...]: rig.toml of the bench with this grid, in $rig. $camera: ROWSxCOLS of the camera, if
# it has pixels of its own.
write_rig() {
  local grid=$1 size=${camera-$1} edits=()
  shift
  for edit in "$@"; do edits+=(-e "$edit"); done
  rig=$BENCH_OUT/rig.toml
  sed -e "s/@GRID@/$grid/; s/@SIZE@/${size#*x}x${size%x*}/; s/@MODE@/$mode/" \
    -e "s/@CELL@/$cell/; s/@TOP@/$top/; s/@LEFT@/$left/" "${edits[@]}" "$here/rig.toml.in" >"$rig"
}

exposures() { grep -c '^{"exposed"' $truth; }

# after_exposures COUNT PID: waits for COUNT exposures of the camera while the process lives.
after_exposures() {
  while [ "$(exposures)" -lt "$1" ]; do
    kill -0 "$2" 2>/dev/null || fail "ended after $(exposures) exposures, but $1 were expected"
    sleep 0.1
  done
}
