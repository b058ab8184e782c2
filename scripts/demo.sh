#!/usr/bin/env bash
# From a fresh Debian 12 to a picture: installs what is missing, builds Release, renders the bundled dam
# break to out/dam-break.png. Asks nothing; run again, it only renders.
set -euo pipefail
source "$(dirname "${BASH_SOURCE[0]}")/common.sh"

particles=data/dam_break.bgeo
picture=out/dam-break.png
# How the picture is made; everything not named here is the program's own choice.
render_options=(--size 1280x720 --spp 64 --denoise)

build() {
  # Only a fresh build directory learns that there may be no GoogleTest here: test.sh turns the tests on.
  local tests=()
  if [ ! -f build/release/CMakeCache.txt ]; then tests=(-DEMBRUN_BUILD_TESTS=OFF -DEMBRUN_BUILD_BENCH=OFF); fi
  cmake --preset release "${tests[@]}" "${configure_options[@]}"
  cmake --build --preset release --target embrun_cli
}

render() {
  mkdir -p out
  build/release/apps/embrun render "$particles" -o "$picture" "${render_options[@]}"
}

step "packages" scripts/setup.sh
step "build" build
step "render" render
report_steps
echo "picture: $PWD/$picture"
