#!/usr/bin/env bash
# Every source that a comment cites, as [Author2004], has its entry in docs/references.bib.
#   scripts/check_references.sh [ROOT]
set -euo pipefail
root=${1:-$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)}
cd "$root"

bibliography=docs/references.bib
missing=0
keys=$(sed -nE 's/^[[:space:]]*@[A-Za-z]+\{([^,[:space:]]+),.*/\1/p' "$bibliography" | sort -u)
while IFS= read -r citation; do
  key=$(sed -E 's/.*\[(.*)\]$/\1/' <<< "$citation")
  if ! grep -qxF -- "$key" <<< "$keys"; then
    echo "${citation%%:\[*}: [$key] is not in $bibliography"
    missing=1
  fi
done < <(grep -rnoE --include='*.h' --include='*.cpp' --include='*.cu' --include='*.md' \
           '\[[A-Z][A-Za-z-]+[12][0-9]{3}[a-z]?\]' src include apps bench docs README.md 2>/dev/null || true)
[ $missing = 0 ] && echo "references: every key that is cited is in $bibliography"
exit $missing
