#!/usr/bin/env bash
# Says how the times of two builds of xtask compare, paired: the two take turns, so that whatever else the machine does
# meets both alike, and each turn gives one ratio NEW/OLD.
#
#     tests/paired_times.sh [--pairs N] [--repeat K] OLD NEW [SHOT ...] [-- ARGUMENT ...]
#
# OLD and NEW are built `xtask` programs (same_bits.sh says how to build them), SHOT built-in shots or shot files
# (default: nave, grove, lamp, stage), ARGUMENT what `render` gets beside them (default: --method epipolar --quality film).
# Each of N pairs (default 7) is a median of K runs (default 5) of either program, who comes first alternating.
#
# Prints a line a shot: the median of the ratios and their range, the medians of the times; then the median over all
# shots. Times are `time_ms.total` of the JSON document: the technique alone, without its maps. Exit status 0 whatever
# the ratios are: what is too slow is for the reader to say; 2: the command line is wrong, or a program fails.
set -u

pairs=7 repeat=5
usage() {
  echo "usage: $0 [--pairs N] [--repeat K] OLD NEW [SHOT ...] [-- ARGUMENT ...]" >&2
  exit 2
}
while [ $# -gt 0 ]; do
  case $1 in
    --pairs | --repeat)
      [ $# -ge 2 ] || usage
      case $2 in '' | 0* | *[!0-9]*) usage ;; esac
      if [ "$1" = --pairs ]; then pairs=$2; else repeat=$2; fi
      shift 2
      ;;
    -*) usage ;;
    *) break ;;
  esac
done
[ $# -ge 2 ] || usage
old=$1 new=$2
shift 2
shots=()
while [ $# -gt 0 ] && [ "$1" != -- ]; do
  shots+=("$1")
  shift
done
[ $# = 0 ] || shift
[ ${#shots[@]} -gt 0 ] || shots=(nave grove lamp stage)
arguments=("$@")
[ ${#arguments[@]} -gt 0 ] || arguments=(--method epipolar --quality film)

folder=$(mktemp -d) || exit 2
trap 'rm -rf "$folder"' EXIT

# milliseconds PROGRAM SHOT: the total of a render.
milliseconds() {
  "$1" render --shot "$2" "${arguments[@]}" --repeat "$repeat" --json --out "$folder/image.exr" \
    >"$folder/document.json" 2>"$folder/said" || {
    echo "$1 fails on $2: $(cat "$folder/said")" >&2
    return 1
  }
  # The first "total" stands in "time_ms", whose stages have names of their own.
  sed -n 's/^ *"total": *\([0-9.eE+-]*\),\{0,1\}$/\1/p' "$folder/document.json" | head -n 1
}

# The median, the least and the largest of the numbers on the input.
spread() {
  sort -g | awk '{ x[NR] = $1 }
    END { m = NR % 2 ? x[(NR + 1) / 2] : (x[NR / 2] + x[NR / 2 + 1]) / 2; printf "%.4f %.4f %.4f\n", m, x[1], x[NR] }'
}

: >"$folder/all"
for shot in "${shots[@]}"; do
  : >"$folder/pairs"
  for ((pair = 0; pair < pairs; pair++)); do
    if ((pair % 2)); then
      new_ms=$(milliseconds "$new" "$shot") && old_ms=$(milliseconds "$old" "$shot") || exit 2
    else
      old_ms=$(milliseconds "$old" "$shot") && new_ms=$(milliseconds "$new" "$shot") || exit 2
    fi
    if [ -z "$old_ms" ] || [ -z "$new_ms" ]; then
      echo "no time_ms.total in the JSON document of $shot" >&2
      exit 2
    fi
    echo "$old_ms $new_ms" >>"$folder/pairs"
  done
  read -r median least most < <(awk '{ print $2 / $1 }' "$folder/pairs" | spread)
  read -r old_median _ < <(awk '{ print $1 }' "$folder/pairs" | spread)
  read -r new_median _ < <(awk '{ print $2 }' "$folder/pairs" | spread)
  echo "$median" >>"$folder/all"
  printf '%-12s new/old %s (%s to %s)   old %s ms, new %s ms\n' \
    "${shot##*/}" "$median" "$least" "$most" "$old_median" "$new_median"
done
read -r median least most < <(spread <"$folder/all")
echo "${#shots[@]} shots, $pairs pairs each of medians of $repeat runs: median of the shots' ratios $median ($least to $most)"
