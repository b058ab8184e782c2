#!/usr/bin/env bash
# Runs clang-tidy-14 over the library's and the program's sources, with build/release's compile commands.
#   scripts/tidy.sh [FILE...]    (default: every source that is compiled)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

files=("$@")
if [ ${#files[@]} = 0 ]; then mapfile -t files < <(find src apps -name '*.cpp' | sort); fi
[ -f build/release/compile_commands.json ] || cmake --preset release > /dev/null
printf '%s\0' "${files[@]}" |
  xargs -0 -n 1 -P "$(nproc)" clang-tidy-14 -p build/release --quiet --extra-arg=-Wno-unknown-warning-option
