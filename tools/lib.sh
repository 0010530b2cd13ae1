# SPDX-License-Identifier: Apache-2.0
# shellcheck shell=bash
# Functions for tools/setup, tools/demo and tools/test: paths, and messages for the user.
# Source it: `. "$(dirname "$0")/lib.sh"`.

set -euo pipefail
export LC_ALL=C.UTF-8

ROOT=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)
LOGS=$ROOT/out/logs
JOBS=${SYMRIG_JOBS:-$(nproc)}
mkdir -p "$LOGS"

# say "text": prints the beginning of a step.
# note "text": prints a detail of it.
say() { printf '\n==> %s\n' "$*"; }
note() { printf '    %s\n' "$*"; }

# die "what went wrong; what to do": prints one line and exits with 1.
die() {
  printf '%s: %s\n' "${0##*/}" "$*" >&2
  exit 1
}

# debian_mirror: the address of the Debian archive that this machine's apt uses.
debian_mirror() {
  local mirror
  mirror=$(apt-get indextargets --format '$(COMPONENT) $(SITE) $(REPO_URI)' "Created-By: Packages" 2>/dev/null |
    awk '$1 == "main" && $3 ~ /\/debian\/?$/ { print $3; exit }') || true
  echo "${mirror:-http://deb.debian.org/debian}"
}

# logged NAME COMMAND...: runs it with its output in out/logs/NAME.log. Shows the end of the log only if the
# command fails.
logged() {
  local name=$1 log=$LOGS/$1.log
  shift
  if "$@" >"$log" 2>&1 </dev/null; then return 0; fi
  printf '%s: %s failed:\n' "${0##*/}" "$name" >&2
  tail -n 40 "$log" >&2
  printf '%s: the whole output is in %s\n' "${0##*/}" "${log#"$ROOT"/}" >&2
  return 1
}

# Prints lines for a private sources.list: the Debian archives that this machine already uses, as sources.
source_lines() {
  local keyring=/usr/share/keyrings/debian-archive-keyring.gpg codename lines
  codename=$(. /etc/os-release && echo "${VERSION_CODENAME:-bookworm}")
  lines=$(apt-get indextargets --format '$(CODENAME) $(COMPONENT) $(REPO_URI) $(RELEASE)' "Created-By: Packages" |
    awk -v name="$codename" -v key="$keyring" '
      $2 == "main" && ($1 == name || $1 == name "-updates" || $1 == name "-security") {
        print "deb-src [signed-by=" key "] " $3 " " $4 " main" }' | sort -u)
  echo "${lines:-deb-src [signed-by=$keyring] http://deb.debian.org/debian $codename main}"
}

# debian_source PACKAGE VERSION FOLDER: the source of a package as its authors published it. apt checks the archive's signature and
# every hash. A private folder contains the package lists, so the machine's own apt sources do not change, and root is not needed.
debian_source() (
  work=$(mktemp -d)
  trap 'rm -rf "$work"' EXIT
  chmod 755 "$work"
  mkdir -p "$work/lists/partial" "$work/cache/archives/partial" "$work/parts" "$work/get" "$3"
  source_lines >"$work/sources.list"
  apt=(apt-get -q -o "Dir::Etc::SourceList=$work/sources.list" -o "Dir::Etc::SourceParts=$work/parts"
    -o "Dir::State::Lists=$work/lists" -o "Dir::Cache=$work/cache" -o APT::Get::List-Cleanup=0 -o APT::Update::Error-Mode=any
    -o Acquire::Retries=2 -o APT::Update::Post-Invoke-Success::= -o APT::Update::Post-Invoke::=)
  logged "$1-lists" "${apt[@]}" update || exit 1
  (cd "$work/get" && logged "$1-source" "${apt[@]}" source --download-only --only-source "$1=$2") || exit 1
  tar -xf "$work/get/$1"_*.orig.tar.* -C "$3" --strip-components=1
)

# build DIR TARGET...: runs Ninja, with its progress line on a terminal; in a pipe it prints only errors.
build() {
  local dir=$1 quiet=()
  shift
  [ -t 1 ] || quiet=(--quiet)
  ninja -C "$dir" -j "$JOBS" "${quiet[@]}" "$@"
}
