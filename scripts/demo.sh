#!/usr/bin/env bash
# From a fresh Debian 12 to a picture: installs what is missing, builds Release, renders the bundled dam
# break to out/dam-break.png. Asks nothing; run again, it only renders.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

particles=data/dam_break.bgeo
picture=out/dam-break.png
# How the picture is made; everything not named here is the program's own choice.
render_options=(--size 1280x720 --spp 64 --denoise)

render() {
  mkdir -p out
  build/release/apps/embrun render "$particles" -o "$picture" "${render_options[@]}"
}

step "packages" scripts/setup.sh
step "build" build_program
step "render" render
report_steps
echo "picture: $PWD/$picture"
