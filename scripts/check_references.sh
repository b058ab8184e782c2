#!/usr/bin/env bash
# Every source that a comment cites, as [Kajiya1986] or [Kajiya1986, Veach1995], has its entry in
# docs/references.bib.
#   scripts/check_references.sh [ROOT]
set -euo pipefail
root=${1:-$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)}
cd "$root"

bibliography=docs/references.bib
keys=$(sed -nE 's/^[[:space:]]*@[A-Za-z]+\{([^,[:space:]]+),.*/\1/p' "$bibliography")
key='[A-Z][A-Za-z-]*[12][0-9]{3}[a-z]?'
cited=0
unknown=0
while IFS= read -r match; do
  place=${match%%:\[*}
  for citation in $(sed -E 's/^.*:\[(.*)\]$/\1/; s/,/ /g' <<< "$match"); do
    cited=$((cited + 1))
    if ! grep -qxF -- "$citation" <<< "$keys"; then
      echo "$place: [$citation] is not in $bibliography"
      unknown=1
    fi
  done
done < <(grep -rnoE "\[$key(, ?$key)*\]" src include apps bench docs README.md || true)
if [ $unknown = 0 ]; then echo "references: all $cited citations are in $bibliography"; fi
exit $unknown
