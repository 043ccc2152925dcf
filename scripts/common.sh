# shellcheck shell=bash
# What scripts/run and scripts/test share: packages, locking, configuring and building.
# It is sourced, never run. Messages go to standard error, so that the program's own output can
# be piped.

root=$(cd -- "$(dirname -- "$(readlink -f -- "${BASH_SOURCE[0]}")")/.." && pwd -P)
build=$root/build
# The first python3 on the PATH may be another one, without Debian's numpy and h5py.
system_python=/usr/bin/python3
[ -x "$system_python" ] || system_python=$(command -v python3 || echo python3)

# shellcheck disable=SC2034 # the scripts that source this file use these
{
  packages_build=(gfortran cmake make libopenblas-dev libmumps-seq-dev libmetis-dev libhdf5-dev zlib1g-dev)
  packages_mpi=(libmumps-dev openmpi-bin)
  packages_iterative=(libpetsc-real-dev)
  packages_scripts=(python3 python3-numpy python3-h5py python3-matplotlib)
  # Ninja builds with less ado than Make.
  packages_tests=(ninja-build python3-venv)
  packages_drawing=(libegl1 libgl1-mesa-dri) # of PyVista without a display
  packages_memcheck=(valgrind)
}

# Of Ninja the percentages that Make writes, too.
export NINJA_STATUS='[%p] '

install=yes
processors=$(nproc 2>/dev/null || echo 2)
jobs=$processors

say() {
  printf 'bipot: %s\n' "$*" >&2
}

# Ends with status 3, the program's own for "the machine failed".
fail() {
  say "$*"
  exit 3
}

wrong_command_line() {
  say "$*"
  exit 1
}

# Refuses what is no number of processes: check_number OPTION VALUE
check_number() {
  [[ $2 =~ ^[1-9][0-9]*$ ]] || wrong_command_line "$1 wants a number of processes, not '$2'"
}

set_jobs() {
  check_number --jobs "$1"
  jobs=$1
}

# Open MPI starts nothing as root unless it is told twice.
allow_root() {
  [ "$(id -u)" -ne 0 ] || export OMPI_ALLOW_RUN_AS_ROOT=1 OMPI_ALLOW_RUN_AS_ROOT_CONFIRM=1
}

# Installs what is missing of the Debian packages named, or says what to do about them.
need_packages() {
  local name status installed missing=()
  if ! command -v dpkg-query >/dev/null; then
    [ -f "$build/CMakeCache.txt" ] || say "not a Debian system; these are needed, under whatever" \
      "names they have here: $*"
    return 0
  fi
  declare -A status=()
  while read -r name installed; do
    status[$name]=$installed
  done < <(dpkg-query -W -f='${Package} ${db:Status-Status}\n' "$@" 2>/dev/null)
  for name in "$@"; do
    [ "${status[$name]-}" = installed ] || missing+=("$name")
  done
  [ ${#missing[@]} -gt 0 ] || return 0

  if [ "$install" = no ]; then
    say "not installed (--no-install was given): ${missing[*]}"
    return 0
  fi
  local as_root=()
  if [ "$(id -u)" -ne 0 ]; then
    command -v sudo >/dev/null || fail "these packages are missing, and there is no sudo to" \
      "install them. As root: apt-get install ${missing[*]}" \
      "(or give --no-install if you have them in another way)"
    as_root=(sudo)
  fi
  say "installing from Debian, with what they need: ${missing[*]}"
  # Old package lists may still do, so a failed update alone is no reason to stop.
  with_progress "$build/apt.log" "updating package lists" "${as_root[@]}" apt-get update || true
  with_progress "$build/apt.log" "installing packages" "${as_root[@]}" \
    env DEBIAN_FRONTEND=noninteractive apt-get install -y --no-install-recommends \
    -o DPkg::Lock::Timeout=300 "${missing[@]}" 9>&- || {
    tail -n 15 "$build/apt.log" >&2
    fail "the packages could not be installed; the whole log is $build/apt.log"
  }
}

# The kernels of OpenBLAS that this processor can run: on x86, where the library has several.
kernels() {
  local flags
  flags=" $(sed -n 's/^flags[[:space:]]*: //p;T;q' /proc/cpuinfo 2>/dev/null) "
  has() { [[ $flags = *" $1 "* ]]; }
  ! has sse4_2 || echo Nehalem
  ! has avx || echo Sandybridge
  ! { has avx2 && has fma; } || printf '%s\n' Haswell Zen
  ! { has avx512f && has avx512cd && has avx512bw && has avx512dq && has avx512vl; } || echo SkylakeX
}

# One script at a time installs and builds. The lock is on descriptor 9: release it before a
# program is started, or that program would hold it for as long as it runs.
lock_build() {
  mkdir -p "$build" || fail "cannot write to $build"
  command -v flock >/dev/null || return 0
  exec 9>"$build/.lock" || fail "cannot write to $build"
  if ! flock -n 9; then
    say "waiting for another build to end"
    flock 9
  fi
}

unlock_build() {
  exec 9>&-
}

# The value of a CMake cache entry: cached FOLDER NAME
cached() {
  sed -n "s/^$2:[A-Z]*=//p" "$1/CMakeCache.txt" 2>/dev/null
}

# How far commands are by their logs: progress_of BEGAN LOG... Builds write percentages, of which the
# mean counts; apt-get says how many packages it installs, unpacks one after the other and sets them up.
# Of others only the time so far is known.
progress_of() {
  local began=$1 log percent sum=0 seconds=$((SECONDS - $1)) total words
  shift
  if total=$(sed -nE 's/^.* ([0-9]+) newly installed,.*/\1/p' "$1" 2>/dev/null | tail -n 1) &&
    [ -n "$total" ]; then
    for words in "Setting up:set up" "Unpacking:unpacked" "Get:downloaded"; do
      percent=$(grep -c "^${words%%:*}" "$1")
      [ "$percent" -eq 0 ] || break
    done
    printf '%s %d of %d, %d s so far' "${words#*:}" "$percent" "$total" "$seconds"
    return
  fi
  for log in "$@"; do
    percent=$(sed -nE 's/^\[ *([0-9]+)%\].*/\1/p' "$log" 2>/dev/null | tail -n 1)
    sum=$((sum + ${percent:-0}))
  done
  percent=$((sum / $#))
  if [ "$percent" -gt 0 ] && [ "$percent" -lt 100 ]; then
    printf '%d %%, about %d s left' "$percent" $((seconds * (100 - percent) / percent))
  else
    printf '%d s so far' "$seconds"
  fi
}

# Reports every 10 seconds, until it is stopped, how far commands are: start_reporter WHAT LOG...
# One reporter at a time: what is begun meanwhile is part of what it reports.
reporter=
start_reporter() {
  local what=$1
  shift
  [ -z "$reporter" ] || return 0
  # In a process group of its own, to be ended with its sleep, which else would keep the output of
  # this script open. It must not hold the lock.
  set -m
  {
    began=$SECONDS
    while sleep 10 && kill -0 $$ 2>/dev/null; do
      say "$what: $(progress_of "$began" "$@")"
    done
  } </dev/null 9>&- &
  reporter=$!
  set +m
}

stop_reporter() {
  [ -n "$reporter" ] || return 0
  kill -- "-$reporter" 2>/dev/null || true
  wait "$reporter" 2>/dev/null || true
  reporter=
}

# Runs a command, its output in a log, with a line of progress every 10 seconds: with_progress LOG
# WHAT COMMAND... The status is the command's.
with_progress() {
  local log=$1 what=$2 status=0 began_here=no
  shift 2
  : >"$log"
  [ -n "$reporter" ] || began_here=yes
  start_reporter "$what" "$log"
  "$@" >>"$log" 2>&1 </dev/null || status=$?
  [ "$began_here" = no ] || stop_reporter
  return "$status"
}

# Runs a command with its output in a log; if it fails, shows the end of the log and ends the
# script: quietly LOG WHAT COMMAND...
quietly() {
  local log=$1 what=$2
  with_progress "$@" && return 0
  tail -n 60 "$log" >&2
  fail "$what failed; the whole log is $log"
}

# Calls CMake only where an entry differs: configure FOLDER NAME=VALUE...
configure() {
  local folder=$1 entry differs=no generator=() options=()
  shift
  [ -f "$folder/Makefile" ] || [ -f "$folder/build.ninja" ] || differs=yes
  if [ -f "$folder/CMakeCache.txt" ] && [ "$(cached "$folder" CMAKE_HOME_DIRECTORY)" != "$root" ]; then
    # The repository was moved or copied with its build folder.
    rm -rf "$folder/CMakeCache.txt" "$folder/CMakeFiles"
    differs=yes
  fi
  for entry in "$@"; do
    [ "$(cached "$folder" "${entry%%=*}")" = "${entry#*=}" ] || differs=yes
    options+=("-D$entry")
  done
  [ "$differs" = yes ] || return 0
  mkdir -p "$folder"
  # A folder keeps the generator that it has.
  [ -f "$folder/CMakeCache.txt" ] || ! command -v ninja >/dev/null || generator=(-G Ninja)
  # Without these a configuration that fails is not taken for a finished one by the next call.
  rm -f "$folder/Makefile" "$folder/build.ninja"
  quietly "$folder/configure.log" "configuring $folder" \
    cmake -S "$root" -B "$folder" "${generator[@]}" "${options[@]}"
}

# Builds what has changed: compile FOLDER [cmake --build options]
compile() {
  local folder=$1
  shift
  quietly "$folder/build.log" "building in $folder" \
    cmake --build "$folder" --parallel "$jobs" "$@"
}
