#!/usr/bin/env bash
# Every folder of src/ that holds code has a README.md: what it is, which file to read first.
#   scripts/check_readmes.sh [ROOT]
set -euo pipefail
root=${1:-$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)}
cd "$root"

missing=0
while IFS= read -r folder; do
  if [ ! -s "$folder/README.md" ]; then
    echo "$folder: no README.md that says what it is and which file to read first"
    missing=1
  fi
done < <(find src -mindepth 2 -type f \( -name '*.h' -o -name '*.cpp' -o -name '*.cu' \) -printf '%h\n' | sort -u)
[ $missing = 0 ] && echo "readmes: every folder of src/ has one"
exit $missing
