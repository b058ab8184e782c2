#!/usr/bin/env bash
# Formats the sources as .clang-format has it.
#   scripts/format.sh [--check]    --check: change nothing, name what would change, end with 1
# Needs clang-format-14 (scripts/setup.sh --ci): other versions format differently.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."

if ! command -v clang-format-14 > /dev/null; then
  echo "skipped: clang-format-14 is not installed (scripts/setup.sh --ci)"
  exit 0
fi
mode=(-i)
if [ "${1:-}" = --check ]; then mode=(--dry-run -Werror --ferror-limit=1); fi
find src include apps tests bench -type f \( -name '*.h' -o -name '*.cpp' -o -name '*.cu' \) -print0 |
  xargs -0 -r clang-format-14 "${mode[@]}"
