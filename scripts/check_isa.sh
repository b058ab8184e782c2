#!/usr/bin/env bash
# Files compiled for more than the base instruction set must not define shared (weak) functions: the linker
# keeps one copy of each, and might give the AVX-512 one to everybody. Names of an instruction set's own
# namespace (embrun::avx2, embrun::avx512) are safe: nobody else defines them.
#   scripts/check_isa.sh BUILD_DIR
set -euo pipefail
cd "$1"

objects=0
offending=0
while IFS= read -r object; do
  [ -f "$object" ] || continue
  objects=$((objects + 1))
  weak=$(nm --defined-only -C "$object" | awk '$2 == "W" && !/embrun::avx(2|512)::/ { $1 = ""; $2 = ""; print "    " $0 }')
  if [ -n "$weak" ]; then
    printf '%s defines functions that the linker shares:\n%s\n' "$object" "$weak"
    offending=1
  fi
done < <(grep '"command"' compile_commands.json | grep -E -- ' -m(avx|fma|arch=x86-64-v[34])' | grep -oE -- '-o [^ ]+\.o' | cut -c4- | sort -u)
[ $offending = 0 ] && echo "instruction sets: $objects wide objects, none defines a shared function"
exit $offending
