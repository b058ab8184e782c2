#!/usr/bin/env bash
# The manual names the options that the program has, and no others.
#   scripts/check_manual.sh PROGRAM [MANUAL]
set -euo pipefail
program=$1
manual=${2:-$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)/docs/manual.md}

# Lines of --help that begin with an option, and the long names on them.
offered=$({ "$program" render --help; "$program" info --help; "$program" mesh --help; "$program" splats --help; "$program" scene --help; "$program" compare --help; "$program" reproduce --help; "$program" bench --help; } |
  grep -E '^ +-' | grep -oE '^ +(-[a-zA-Z],)?--[a-z-]+' | grep -oE -- '--[a-z-]+' | grep -vx -- --help | sort -u)
explained=$(grep -oE -- '--[a-z][a-z-]+' "$manual" | grep -vx -- --help | sort -u)
difference=$(diff <(echo "$offered") <(echo "$explained") || true)
if [ -n "$difference" ]; then
  echo "< is an option without a word in $manual; > is named there and does not exist"
  grep '^[<>]' <<< "$difference"
  exit 1
fi
echo "manual: all $(wc -l <<< "$offered") options are explained"
