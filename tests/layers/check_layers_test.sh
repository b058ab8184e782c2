#!/usr/bin/env bash
# Shows that scripts/check_layers.sh refuses what it must: plants one forbidden include at a time in a
# copy of the sources. Usage: check_layers_test.sh SOURCE_DIR
set -euo pipefail
source_dir=$1
work=$(mktemp -d)
trap 'rm -rf "$work"' EXIT
failures=0

fresh_copy() {
  rm -rf "$work/tree"
  mkdir -p "$work/tree"
  cp -r "$source_dir/src" "$source_dir/apps" "$source_dir/include" "$work/tree/"
}

# expect refused|accepted FILE LINE: adds the line to a fresh copy's file, runs the check.
expect() {
  local wanted=$1 file=$2 line=$3 outcome=accepted
  fresh_copy
  mkdir -p "$work/tree/$(dirname "$file")"
  printf '%s\n' "$line" >> "$work/tree/$file"
  "$source_dir/scripts/check_layers.sh" "$work/tree" > "$work/output" || outcome=refused
  # The one line planted is the one complained of, by file name.
  if [ $outcome = refused ] && [ "$(wc -l < "$work/output")" != 1 ]; then outcome="refused with other complaints"; fi
  if [ $outcome = refused ] && ! grep -q "^$file:" "$work/output"; then outcome="refused for another file"; fi
  if [ "$outcome" != "$wanted" ]; then
    echo "FAIL: '$line' in $file was $outcome, not $wanted"
    cat "$work/output"
    failures=$((failures + 1))
  fi
}

expect refused  src/base/planted.h '#include "math/vec.h"'
expect refused  src/math/planted.h '#include "sampling/warp.h"'
expect refused  src/image/planted.h '#include "particles/particle_set.h"'
expect refused  src/geometry/planted.cpp '#include "integrators/path_state.h"'
expect refused  src/geometry/planted.cpp '#include "materials/bsdf.h"'
expect refused  src/integrators/planted.h '  #  include  "scene/description.h"'
expect refused  src/io/planted.cpp '#include "render/render.h"'
expect refused  src/io/planted.cpp '#include "geometry/implicit_surface.h"'
expect accepted src/io/planted.cpp '#include "geometry/triangle_mesh.h"'
expect refused  src/backend/cpu/planted.cpp '#include "backend/cuda/device_check.h"'
expect refused  src/backend/cpu/planted.cpp '#include "scene/description.h"'
expect refused  src/scene/planted.cpp '#include <embrun/embrun.h>'
expect refused  src/geometry/planted.cpp '#include <embree3/rtcore.h>'
expect refused  src/geometry/planted.cpp '#include <openvdb/openvdb.h>'
expect refused  src/math/planted.h '#include "../base/error.h"'
expect refused  src/nowhere/planted.h '#include "base/error.h"'
expect refused  apps/planted.cpp '#include "io/particles.h"'
expect refused  include/embrun/planted.h '#include "math/vec.h"'
expect refused  include/embrun/planted.h '#include <fmt/format.h>'
expect accepted include/embrun/planted.h '#include <vector>'
expect accepted apps/planted.cpp '#include <embrun/embrun.h>'
expect accepted src/math/planted.h '#include "base/error.h"'
expect accepted src/media/planted.h '#include "geometry/ball.h"'
expect accepted src/backend/cpu/planted.cpp '#include <embree3/rtcore.h>'
expect accepted src/backend/cpu/planted.cpp '#include "scene/flat_scene.h"'
expect accepted src/render/planted.cpp '#include <embrun/embrun.h>'

[ $failures = 0 ] && echo "check_layers.sh told all planted includes right"
exit $((failures > 0))
