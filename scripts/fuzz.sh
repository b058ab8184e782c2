#!/usr/bin/env bash
# Fuzzes every reader for an equal share of the time and reports executions and coverage.
#   scripts/fuzz.sh SECONDS [TARGET...]     SECONDS in all; TARGET: bgeo ply vtk ... (default: every one)
# Builds the preset "fuzz" (clang). What was learned stays in build/fuzz/corpus, inputs that fail go to
# build/fuzz/findings. Ends with 1 when an input made a reader crash, hang, or use too much memory.
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

case ${1:-} in
  '' | *[!0-9]*) sed -n '2,5s/^# \?//p' "${BASH_SOURCE[0]}" >&2; exit 2 ;;
esac
total=$1
shift

# A folder that was configured before (with tests, by .ci/run) keeps its options.
cmake --preset fuzz "${configure_options[@]}" > /dev/null
names=("$@")
if [ $# = 0 ]; then
  mapfile -t names < <(ninja -C build/fuzz -t targets all | sed -nE 's#^(.*/)?fuzz_([a-z0-9_]+): .*#\2#p' | sort -u)
fi
cmake --build build/fuzz --target "${names[@]/#/fuzz_}" > build/fuzz/fuzzers.log || { cat build/fuzz/fuzzers.log; exit 1; }
share=$((total / ${#names[@]}))
if [ $share -lt 1 ]; then share=1; fi

failed=0
printf '%-10s %12s %10s %8s %22s\n' target executions per-second corpus 'edges covered'
for name in "${names[@]}"; do
  program=$(find build/fuzz -type f -name "fuzz_$name" -perm -u+x -print -quit)
  corpus=build/fuzz/corpus/$name findings=build/fuzz/findings/$name log=build/fuzz/$name.log
  mkdir -p "$corpus" "$findings"
  folders=("$corpus")
  for seeds in "tests/fuzz/seeds/$name" "tests/fuzz/corpus/$name"; do
    if [ -d "$seeds" ]; then folders+=("$seeds"); fi
  done
  options=(-max_total_time=$share -max_len=16384 -rss_limit_mb=2048 -malloc_limit_mb=512 -timeout=10
           -print_final_stats=1 -artifact_prefix="$findings/")
  if [ -f "tests/fuzz/dictionaries/$name.dict" ]; then options+=("-dict=tests/fuzz/dictionaries/$name.dict"); fi
  status=0
  "$program" "${options[@]}" "${folders[@]}" 2> "$log" || status=$?
  awk -v name="$name" '
    /Loaded .* inline 8-bit counters/ { match($0, /\([0-9]+ inline/); edges = substr($0, RSTART + 1, RLENGTH - 8) }
    / cov: / { for (i = 1; i < NF; i++) { if ($i == "cov:") cov = $(i + 1); if ($i == "corp:") corpus = $(i + 1) } }
    /number_of_executed_units/ { runs = $2 }
    /average_exec_per_sec/ { rate = $2 }
    END {
      sub(/\/.*/, "", corpus)
      printf "%-10s %12d %10d %8d %14d of %d\n", name, runs, rate, corpus, cov, edges
    }' "$log"
  if [ $status != 0 ]; then
    failed=1
    printf 'fuzz.sh: %s failed (status %d); its last words, and the input in %s:\n' "$name" "$status" "$findings" >&2
    tail -40 "$log" >&2
  fi
done
exit $failed
