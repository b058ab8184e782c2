#!/usr/bin/env bash
# Sand, bubbles and foam for water at rest, which no solver made: from the particles of a file as SPlisHSPlasH writes it
# (classic BGEO of position, id, velocity, density; +y up), as CSV files of x, y, z and radius.
#   scripts/pool_particles.sh WATER.bgeo FOLDER       writes FOLDER/sand.csv, bubbles.csv and foam.csv
#
# sand     particles of the bottom, below a height that ripples from place to place; each becomes a handful of grains
# bubbles  particles in four columns that widen as they rise; each becomes up to ten bubbles, larger towards the top
# foam     particles of the top layer, where a slow wave over the surface is high
# What looks random is a function of a particle's place in the file: the same input gives the same output.
set -euo pipefail
if [ $# != 2 ]; then sed -n '2,5s/^# \{0,1\}//p' "${BASH_SOURCE[0]}" >&2; exit 2; fi
water=$1 folder=$2
mkdir -p "$folder"

plain=$(mktemp)
trap 'rm -f "$plain"' EXIT
gzip -dcf "$water" > "$plain"

bytes_per_particle=36
size=$(wc -c < "$plain")
# The count is the second number of the header, which ends where the particles begin; two bytes follow them.
count=$(od -A n -t u4 --endian=big -j 9 -N 4 "$plain" | tr -d ' ')
header=$((size - 2 - count * bytes_per_particle))
if [ "$(head -c 4 "$plain")" != Bgeo ] || [ "$header" != 102 ]; then
  echo "pool_particles.sh: $water: not a BGEO file of position, id, velocity and density" >&2
  exit 1
fi

od -A n -v -t f4 --endian=big -w$bytes_per_particle -j "$header" -N $((count * bytes_per_particle)) "$plain" |
  LC_ALL=C awk -v folder="$folder" '
  # A number in [0, 1) that looks random, another one at each call.
  function draw() { state = (state * 16807) % 2147483647; return state / 2147483647 }
  function reach(v, r) { return v + r * (2 * draw() - 1) }
  function emit(file, x, y, z, radius) { printf "%.5f,%.5f,%.5f,%.5f\n", x, y, z, radius > (folder "/" file ".csv") }
  BEGIN {
    for (i = split("sand bubbles foam", files, " "); i > 0; --i) print "x,y,z,radius" > (folder "/" files[i] ".csv")
    # Where bubbles come from: the middles of the columns, and their shares of the particles in them.
    vents = split("-1.3 -0.25  -0.35 0.55  0.6 -0.6  1.45 0.35", vent, " ") / 2
    spacing = 0.0465
    surface = 0.81
  }
  {
    x = $1; y = $2; z = $3
    state = NR * 7919 + 1
    draw(); draw()

    bed = 0.10 + 0.035 * sin(5.1 * x + 1.3 * sin(2.3 * z)) + 0.03 * sin(1.7 * z - 0.8 * x)
    if (y < bed)
      for (i = 0; i < 20; ++i)
        emit("sand", reach(x, spacing / 2), reach(y, spacing / 2), reach(z, spacing / 2), 0.005 + 0.005 * draw())

    for (i = 1; i <= vents; ++i) {
      dx = x - vent[2 * i - 1] - 0.05 * sin(9 * y + i); dz = z - vent[2 * i] - 0.05 * cos(7 * y + 2 * i)
      radius = 0.05 + 0.14 * y
      if (y < bed || y > surface || dx * dx + dz * dz > radius * radius) continue
      for (several = 10 * (1 - (dx * dx + dz * dz) / (radius * radius)) * draw(); several > 1; --several) {
        size = draw()
        emit("bubbles", reach(x, spacing / 2), reach(y, spacing / 2), reach(z, spacing / 2),
             (0.0025 + 0.008 * size * size * size) * (1 + 0.5 * y))
      }
    }

    raft = sin(1.9 * x + 0.7 * sin(2.1 * z)) + sin(2.7 * z - 1.1 * x + 0.9 * sin(1.3 * x))
    if (y > surface - 0.02 && y < 0.9 && raft > 0.7 + 0.5 * draw())
      for (i = 0; i < 8; ++i)
        emit("foam", reach(x, spacing / 2), 0.012 + y + 0.02 * draw(), reach(z, spacing / 2), 0.006 + 0.008 * draw())
  }'
wc -l "$folder"/sand.csv "$folder"/bubbles.csv "$folder"/foam.csv | awk '{ print $1 - 1, $2 }' | head -3
