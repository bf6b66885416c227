#!/usr/bin/env bash
# Says whether two builds of xtask make the same images to the bit: a change of structure must change no pixel.
#
#     tests/same_bits.sh OLD NEW [SHOT.toml ...]
#
# OLD and NEW are built `xtask` programs, SHOT.toml further shot files beside the built-in shots, which are taken from
# `OLD shots`. The two are built by (COMMIT is the state that shall be kept):
#
#     git worktree add ../old COMMIT
#     (cd ../old && cargo build --release -p xtask)      # OLD is ../old/target/release/xtask
#     cargo build --release -p xtask                     # NEW is target/release/xtask
#
# On every shot both render the marcher (steps, jitter, distribution), both truths, and the epipolar integrator at every
# quality level and with every option at each of its choices or at both ends and the middle of its range. Images are
# small, some of odd sizes, some just large enough that the epipolar integrator measures its spacing; a few are rendered
# by the portable code (SCATTER_SIMD=baseline) as well. Equal means: the same exit status, and then the same bytes of
# the EXR file or the same message. What is refused by both says nothing about pixels and is counted apart.
#
# Prints a line for each difference and a closing count. Exit status 0: all equal; 1: a difference, or nothing was
# compared; 2: the command line is wrong. Takes about six minutes on two cores.
set -u

usage() {
  echo "usage: $0 OLD NEW [SHOT.toml ...]   (OLD, NEW: two built xtask programs)" >&2
  exit 2
}
[ $# -ge 2 ] || usage
old=$1 new=$2
shift 2
for program in "$old" "$new"; do
  if [ ! -f "$program" ] || [ ! -x "$program" ]; then
    echo "$program is no program; build one with \`cargo build --release -p xtask\`" >&2
    exit 2
  fi
done
for shot in "$@"; do
  if [ ! -f "$shot" ]; then
    echo "$shot is no file; give shot files after OLD and NEW" >&2
    exit 2
  fi
done

# One case a line: what is given to `render` beside the shot. A word KEY=VALUE in front is set in the environment.
cases() {
  local size="--size 160x120 --shadow-map 256"
  local wide="--size 161x97 --shadow-map 253" tall="--size 97x161 --shadow-map 257"
  # From a diagonal of 480 pixels on the presets measure their spacing.
  local measured="--size 401x301 --shadow-map 512"

  echo "--method truth-shadow-map $size"
  echo "--method truth-shadow-map $tall"
  echo "--method truth-raycast --size 63x47 --shadow-map 64"

  local march="--method raymarch"
  local steps distribution jitter level value
  for steps in 1 63 512; do echo "$march --set steps=$steps $size"; done
  for distribution in uniform equi-angular; do
    echo "$march --set steps=100 --set distribution=$distribution $wide"
  done
  for jitter in on 7; do echo "$march --set steps=100 --set jitter=$jitter $tall"; done
  echo "SCATTER_SIMD=baseline $march --set steps=100 --set jitter=on $size"

  local epipolar="--method epipolar"
  for level in preview game film; do
    echo "$march --quality $level $size"
    echo "$epipolar --quality $level $size"
    echo "$epipolar --quality $level $measured"
  done
  echo "$epipolar --quality film $wide"
  echo "$epipolar --quality film $tall"
  echo "$epipolar --size 1x97 --shadow-map 512"
  echo "$epipolar --size 161x1 --shadow-map 512"
  echo "$epipolar --size 17x9 --shadow-map 1"
  echo "SCATTER_SIMD=baseline $epipolar --quality film $size"
  for value in spacing=0.0625 spacing=1 spacing=16 fewest=1 fewest=10000 tolerance=0 tolerance=0.003 tolerance=1 \
    halvings=0 halvings=1 halvings=2 halvings=3 halvings=4 halvings=5 halvings=6 split=0 split=1 split=16 \
    rank=1 rank=2 rank=3 rank=4 rank=5 rank=6 rank=7 rank=8 rank=auto \
    factorisation=chebyshev factorisation=svd \
    integrator=blocks integrator=sweep integrator=tree integrator=cursor integrator=direct integrator=auto \
    cells=exact cells=uniform cells=modes cells=box around=bands around=ring \
    resampling=pixels resampling=rectified; do
    echo "$epipolar --set $value $size"
  done
  # Options that meet each other in one code path.
  for value in "factorisation=svd --set rank=3" "around=ring --set cells=uniform" "spacing=4 --set tolerance=0.01" \
    "resampling=rectified --set cells=box" "resampling=rectified --set around=ring" \
    "integrator=tree --set cells=modes" "integrator=direct --set spacing=2"; do
    echo "$epipolar --quality film --set $value $wide"
  done
}

folder=$(mktemp -d) || exit 2
trap 'rm -rf "$folder"' EXIT
equal=0 different=0 refused=0

# render PROGRAM NAME ARGUMENTS...: the image at NAME.exr, its messages at NAME.said, its exit status at NAME.status.
render() {
  local program=$1 name=$2
  shift 2
  rm -f "$folder/$name.exr"
  (
    if [ "${1%%=*}" = SCATTER_SIMD ]; then
      export "$1"
      shift
    fi
    # The report has times in it: only what is said on the error output counts.
    "$program" render "$@" --out "$folder/$name.exr" 2>"$folder/$name.said" >/dev/null
    echo $? >"$folder/$name.status"
  )
}

# A difference of two cases: what was rendered, and how the two differ.
differs() {
  different=$((different + 1))
  echo "DIFFERENT  $1: $2"
}

# one_case SHOT ARGUMENTS...
one_case() {
  local shot=$1
  shift
  local simd=() what="$shot $*"
  if [ "${1%%=*}" = SCATTER_SIMD ]; then
    simd=("$1")
    shift
  fi
  # Both at once: most of the time goes into the maps, on one core.
  render "$old" old "${simd[@]+"${simd[@]}"}" --shot "$shot" "$@" &
  render "$new" new "${simd[@]+"${simd[@]}"}" --shot "$shot" "$@"
  wait
  local old_status new_status
  read -r old_status <"$folder/old.status"
  read -r new_status <"$folder/new.status"
  if [ "$old_status" != "$new_status" ]; then
    differs "$what" "OLD exits with $old_status, NEW with $new_status: $(cat "$folder/old.said" "$folder/new.said")"
  elif [ "$old_status" = 2 ]; then
    if cmp -s "$folder/old.said" "$folder/new.said"; then
      refused=$((refused + 1))
    else
      differs "$what" "refused with other words: $(cat "$folder/old.said" "$folder/new.said")"
    fi
  elif [ "$old_status" != 0 ] || [ ! -s "$folder/old.exr" ] || [ ! -s "$folder/new.exr" ]; then
    differs "$what" "no image from either, exit status $old_status: $(cat "$folder/old.said")"
  elif cmp "$folder/old.exr" "$folder/new.exr" >"$folder/cmp.said" 2>&1; then
    equal=$((equal + 1))
  else
    differs "$what" "$(cat "$folder/cmp.said")"
  fi
}

# The names of the built-in shots are the first words of the lines between the table's head and the first empty line.
shots=()
{
  read -r _
  while read -r name _ && [ -n "$name" ]; do shots+=("$name"); done
} < <("$old" shots)
if [ ${#shots[@]} = 0 ]; then
  echo "$old shots names no shot; is it xtask?" >&2
  exit 2
fi

for shot in "${shots[@]}" "$@"; do
  while read -r arguments; do
    # shellcheck disable=SC2086 # a case is a list of words
    one_case "$shot" $arguments
  done < <(cases)
done

count=$((equal + different + refused))
echo "$count cases on $((${#shots[@]} + $#)) shots: $equal equal to the bit, $different different, $refused refused by both"
[ "$different" = 0 ] && [ "$equal" -gt 0 ]
