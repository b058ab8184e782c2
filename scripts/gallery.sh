#!/usr/bin/env bash
# Makes the pictures of docs/gallery.md in out/gallery/, by the commands that stand there.
#   scripts/gallery.sh [--quick] [NAME...]    those of these names, or all; --quick: small and noisy, to see what they are
#   scripts/gallery.sh --list                 the names
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

gallery=docs/gallery.md

# The shell block of the gallery that writes out/gallery/NAME.png; without a name: the names of all.
commands_of() {
  awk -v name="${1:-}" '
    /^```sh$/ { inside = 1; block = ""; next }
    /^```$/ {
      inside = 0
      if (match(block, /-o out\/gallery\/[a-z-]+\.png/)) {
        found = substr(block, RSTART + 15, RLENGTH - 19)
        if (name == "") print found
        else if (found == name) printf "%s", block
      }
    }
    inside { block = block $0 "\n" }' "$gallery"
}

quick=false
names=()
for argument in "$@"; do
  case $argument in
    --list) commands_of; exit ;;
    --quick) quick=true ;;
    *) names+=("$argument") ;;
  esac
done
if [ ${#names[@]} = 0 ]; then mapfile -t names < <(commands_of); fi
for name in "${names[@]}"; do
  if [ -z "$(commands_of "$name")" ]; then
    echo "gallery.sh: no picture $name; there are: $(commands_of | paste -sd ' ')" >&2
    exit 2
  fi
done

step "packages" scripts/setup.sh
step "build" build_program
export PATH=$PWD/build/release/apps:$PATH
mkdir -p out/gallery
for name in "${names[@]}"; do
  commands=$(commands_of "$name")
  if $quick; then commands=$(sed -E 's/--size [0-9]+x[0-9]+/--size 320x180/; s/--spp [0-9]+/--spp 8/' <<< "$commands"); fi
  step "$name" bash -euc "$commands"
done
report_steps
